"""The way to a reference that is elsewhere, by hand."""

import numpy as np
import pytest

from climber_uk.control.approach import Approach, braked, nearest
from climber_uk.control.time_scaling import Pace
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint

AT_REST = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
OPTIONS = Approach(approach_speed=0.1, approach_yaw_rate=0.5)


@pytest.mark.parametrize(
    ("x", "heading", "seconds", "fastest", "fastest_turn"),
    [
        (1.0, 0.0, 18.75, 0.1, 0.0),  # 15/8 of 10 s
        (-1.0, 0.0, 18.75, -0.1, 0.0),  # in reverse gear
        (0.04, 0.0, 1.519671, 0.04 * 15 / 8 / 1.519671, 0.0),  # at 0.1 m/s² at most
        (5e-4, 0.0, 0.8, 5e-4 * 15 / 8 / 0.8, 0.0),  # no move is shorter
        (0.0, 1.0, 3.75, 0.0, 0.5),
        (0.0, -1.0, 3.75, 0.0, -0.5),
        (0.0, 0.0, 0.05, 0.0, 0.0),  # it is there, and stays for a point
        (1.0, 0.5, 18.75 + 1.875, 0.1, 0.5),
    ],
)
def test_a_way_takes_as_long_as_its_fastest_speed_and_turn_need(
    x, heading, seconds, fastest, fastest_turn
):
    target = ReferencePoint(x, 0.0, heading, *[0.0] * 8)
    way = OPTIONS.way(AT_REST, target, SECOND)
    assert (way.times[-1] - way.times[0]) / SECOND == pytest.approx(seconds, abs=1e-6)
    assert 0 < np.diff(way.times).min() <= np.diff(way.times).max() <= SECOND // 20
    for wanted, rates in ((fastest, way.velocity[:, 0]), (fastest_turn, way.velocity[:, 2])):
        there = rates[np.abs(rates).argmax()]
        assert there == pytest.approx(wanted, rel=0.02)  # between two points it may be faster
        assert (rates * wanted >= 0).all()


def test_velocities_of_a_way_are_the_integral_of_its_accelerations_and_its_pose_of_them():
    way = OPTIONS.way(AT_REST, ReferencePoint(0.2, 0.3, 1.0, *[0.0] * 8), SECOND)
    steps = np.diff(way.times / SECOND)[:, None]
    for rates, values in ((way.acceleration, way.velocity), (way.velocity, way.pose)):
        middle = (rates[1:] + rates[:-1]) / 2
        np.testing.assert_allclose(np.cumsum(steps * middle, axis=0), values[1:], atol=6e-3)


def test_for_a_few_millimetres_it_does_not_turn():
    way = OPTIONS.way(AT_REST, ReferencePoint(0.001, 0.004, 0.2, *[0.0] * 8), SECOND)
    assert way.times[-1] <= 3 * SECOND
    assert np.abs(way.velocity[:, 2]).max() <= 0.36
    np.testing.assert_allclose(way.pose[-1], (0.001, 0.004, 0.2), atol=1e-12)


@pytest.mark.parametrize("rate", [1.0, 0.4])
def test_what_is_followed_comes_to_rest_along_itself(rate):
    followed = along_a_line(0.2)
    way = braked(followed, 3 * SECOND, Pace(rate=rate), 5 * SECOND)
    assert way.times[0] == 5 * SECOND
    assert (way.times[-1] - way.times[0]) / SECOND == pytest.approx(0.8)
    np.testing.assert_allclose(way.velocity[0], (0.2 * rate, 0, 0), atol=1e-12)
    np.testing.assert_allclose(way.velocity[-1], 0, atol=1e-12)
    assert way.pose[-1, 0] == pytest.approx(0.4 + 0.2 * rate * 0.8 / 2)
    assert (np.diff(way.velocity[:, 0]) <= 0).all()
    middle = (way.velocity[1:] + way.velocity[:-1]) / 2 * 0.02
    np.testing.assert_allclose(np.cumsum(middle, axis=0), way.pose[1:] - way.pose[0], atol=1e-4)


def test_what_is_at_its_end_cannot_be_braked_along():
    assert braked(along_a_line(0.2), 11 * SECOND, Pace(), SECOND) is None


def along_a_line(speed):
    """Reference that has been at x = `speed` (t - 1 s) since 1 s, for 10 s."""
    times = SECOND * np.arange(1, 12)
    pose, velocity = np.zeros((11, 3)), np.zeros((11, 3))
    pose[:, 0], velocity[:, 0] = speed * np.arange(11), speed
    return Preview(times, pose, velocity, np.zeros((11, 3)))


@pytest.mark.parametrize(
    ("x", "y", "later"),
    [
        (0.105, 0.0, 0.525),
        (0.113, 0.4, 0.565),  # beside it, too
        (0.0, 0.0, 0.0),
        (-0.3, 0.0, 0.0),  # it is not gone back for
        (0.9, 0.0, 2.0),  # nor further on than may be left out
    ],
)
def test_the_nearest_time_of_a_reference_is_that_of_the_place_beside_the_climber(x, y, later):
    motion = AT_REST._replace(x=x + 0.4, y=y)
    for speed in (0.2, -0.2):
        here = motion._replace(x=motion.x * speed / 0.2)
        found = nearest(along_a_line(speed), here, 3 * SECOND, 2 * SECOND)
        assert found / SECOND - 3 == pytest.approx(later, abs=1e-6)
