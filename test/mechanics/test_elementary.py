import math

import numpy as np
import pytest

from climber_uk.mechanics import elementary

VALUES = [-4.0, -0.5, -0.0, 0.3, 2.0, 7.0]


@pytest.mark.parametrize(
    "function",
    [
        *(elementary.cos, elementary.sin, elementary.arctan, elementary.tanh, elementary.sign),
        *(lambda x: elementary.sqrt(abs(x)), elementary.wrapped),
        lambda x: elementary.clipped(x, -1.5, 0.5),
        lambda x: elementary.select(x > 0.1, x, -2 * x),
        lambda x: elementary.with_sign_of(2.0, x),
    ],
)
def test_one_number_gives_what_it_gives_among_many_and_stays_a_float(function):
    together = function(np.array(VALUES))
    for value, expected in zip(VALUES, together, strict=True):
        alone = function(value)
        assert type(alone) is float
        assert alone == pytest.approx(expected, rel=1e-15, abs=1e-15)


def test_angles_are_wrapped_to_half_a_turn_either_way():
    assert elementary.wrapped(math.pi) == -math.pi
    assert elementary.wrapped(3 * math.pi / 2) == pytest.approx(-math.pi / 2)


@pytest.mark.parametrize("largest", [0.02, 3.0])
def test_turning_many_is_turning_each(largest):
    random = np.random.default_rng(2)
    heading, angle = random.uniform(-4, 4, 50), random.uniform(-largest, largest, 50)
    end, cosine, sine = elementary.rotated(heading, np.cos(heading), np.sin(heading), angle)
    for i in range(50):
        alone = elementary.rotated(*(float(v) for v in (heading[i], 0.0, 0.0, angle[i])))
        assert (end[i], cosine[i], sine[i]) == pytest.approx(alone, abs=3e-16)


def test_after_many_small_turns_cosine_and_sine_still_have_length_one():
    heading, angle = np.array([0.3]), np.array([0.0299])
    cosine, sine = np.cos(heading), np.sin(heading)
    for _ in range(20_000):
        heading, cosine, sine = elementary.rotated(heading, cosine, sine, angle)
    np.testing.assert_allclose(cosine**2 + sine**2, 1, atol=1e-12)
    np.testing.assert_allclose(cosine, np.cos(heading), atol=1e-10)


def test_an_angle_is_turned_by_the_same_bits_in_any_company():
    random = np.random.default_rng(3)
    heading, angle = random.uniform(-4, 4, 50), random.uniform(-0.06, 0.06, 50)
    given = heading, np.cos(heading), np.sin(heading), angle
    together = elementary.rotated(*given)
    for few in (slice(0, 1), slice(7, 8), slice(10, 35), np.abs(angle) < elementary.SMALL_ANGLE):
        alone = elementary.rotated(*(numbers[few] for numbers in given))
        for part, whole in zip(alone, together, strict=True):
            np.testing.assert_array_equal(part, whole[few])


@pytest.mark.parametrize("largest", [0.02, 0.06, 3.0])
def test_halfway_and_at_the_end_of_a_turn_it_is_turned_like_that(largest):
    random = np.random.default_rng(4)
    heading, halfway, angle = random.uniform(-largest, largest, (3, 50))
    many = heading, np.cos(heading), np.sin(heading)
    one = tuple(float(numbers[0]) for numbers in many)
    for start, half, whole in ((many, halfway, angle), (one, float(halfway[0]), float(angle[0]))):
        expected = *elementary.rotated(*start, half)[1:], *elementary.rotated(*start, whole)
        for got, wanted in zip(elementary.swept(*start, half, whole), expected, strict=True):
            np.testing.assert_array_equal(got, wanted)


@pytest.mark.parametrize("values", [[1.0, 2.0], [1.0, -2.0], [-0.0, 3.0], [0.0], [np.nan, 1.0], []])
def test_a_sign_is_the_same_for_many_that_share_it(values):
    got = np.broadcast_to(elementary.with_sign_of(2.0, np.array(values)), len(values))
    np.testing.assert_array_equal(got, [math.copysign(2.0, value) for value in values])


@pytest.mark.parametrize(
    ("before", "now", "time", "turn"),
    [
        (3.1, -3.1, 0.02, 0.0832),  # from -π to π
        (0.1, 6.2, 0.02, -0.1832),  # from 0 to 2π, backwards
        (0.1, 1.9, 0.02, 1.8),
        (20.0, 26.2, 0.02, 6.2),  # at 8 m/s, counted on
        (6.2, 12.4, 0.02, 6.2),
        (3.1, -3.1, 0.1, -6.2),  # long enough for a real one
    ],
)
def test_a_wheels_turn_is_that_of_angles_that_go_on_or_begin_anew(before, now, time, turn):
    assert elementary.turned(now, before, time) == pytest.approx(turn, abs=1e-4)
