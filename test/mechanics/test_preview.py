from dataclasses import replace

import numpy as np
import pytest

from climber_uk.mechanics.preview import Preview, joined
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory

PAPER = Trajectory(Ellipse(), ConstantRate())
PERIOD = 50_000_000  # [ns]


def preview(first, last):
    numbers = np.arange(first, last)
    reference = PAPER.at(numbers * PERIOD * 1e-9)
    return Preview(numbers * PERIOD, reference.pose, reference.velocity, reference.acceleration)


def test_between_points_the_reference_is_met_to_the_order_of_the_interpolation():
    h = PERIOD * 1e-9
    window = preview(0, 80)
    for time in range(0, 79 * PERIOD, 7_777_777):
        got, exact = window.at(time), PAPER.at(time * 1e-9)
        # the sixth derivative of 10 sin t is at most 10
        np.testing.assert_allclose(got.pose[:2], exact.pose[:2], atol=10 * h**6 / 46080 + 1e-13)
        assert np.abs(np.sin(got.heading - exact.heading)) < 1e-8
        np.testing.assert_allclose(got.velocity[:2], exact.velocity[:2], atol=10 * h**5 / 1000)
        np.testing.assert_allclose(got.acceleration[:2], exact.acceleration[:2], atol=10 * h**4)
        np.testing.assert_allclose(got.jerk, exact.jerk, atol=10 * h**3)


def test_overlapping_previews_agree_to_the_last_bit():
    early, late = preview(0, 20), preview(7, 30)
    for time in range(7 * PERIOD, 19 * PERIOD, 3_333_333):
        for name in ("pose", "velocity", "acceleration", "jerk"):
            np.testing.assert_array_equal(
                getattr(early.at(time), name), getattr(late.at(time), name)
            )


def test_a_heading_that_wraps_around_is_followed_the_short_way():
    # anticlockwise through π: the message carries it modulo 2π
    poses = np.array([[0.0, 0.0, np.pi - 0.01], [0.0, 0.0, -np.pi + 0.01]])
    spin = np.array([[0, 0, 0.02], [0, 0, 0.02]])
    window = Preview(np.array([0, 10**9]), poses, spin, np.zeros((2, 3)))
    assert window.at(5 * 10**8).heading == pytest.approx(np.pi)


def test_outside_of_its_points_a_preview_knows_nothing():
    window = preview(2, 5)
    assert window.at(2 * PERIOD - 1) is None
    assert window.at(4 * PERIOD + 1) is None
    assert window.at(2 * PERIOD) is not None
    assert window.at(4 * PERIOD) is not None


def test_joined_previews_know_all_that_each_knew():
    whole = joined([preview(0, 10), preview(5, 20)])
    assert whole.at(0) is not None
    np.testing.assert_array_equal(whole.at(19 * PERIOD).pose, preview(5, 20).at(19 * PERIOD).pose)


def test_points_out_of_order_or_not_finite_are_refused():
    good = preview(0, 3)
    with pytest.raises(ValueError, match="order of time"):
        Preview(good.times[::-1], good.pose, good.velocity, good.acceleration)
    with pytest.raises(ValueError, match="1 points must be >= 2"):
        preview(0, 1)
    with pytest.raises(ValueError, match="velocity of a point is not finite"):
        Preview(good.times, good.pose, good.velocity * np.nan, good.acceleration)


def test_a_preview_that_goes_on_keeps_what_was_before_it():
    old, newer = preview(0, 40), preview(20, 60)
    assert old.goes_on_with(newer, 1e-9)
    joint = old.continued(newer, since=10 * PERIOD)
    np.testing.assert_array_equal(joint.times, np.arange(10, 60) * PERIOD)
    for time, one in ((15 * PERIOD + 7, old), (20 * PERIOD, newer), (48 * PERIOD + 9, newer)):
        np.testing.assert_array_equal(joint.at(time).pose, one.at(time).pose)


def test_a_preview_of_something_else_does_not_go_on():
    old, newer = preview(0, 40), preview(20, 60)
    elsewhere = replace(newer, pose=newer.pose + np.array([0.1, 0.0, 0.0]))
    assert not old.goes_on_with(elsewhere, 0.05)
    turned = replace(newer, pose=newer.pose + np.array([0.0, 0.0, 2 * np.pi]))
    assert old.goes_on_with(turned, 1e-9)
    assert not old.goes_on_with(preview(60, 80), 0.05)


def turned(angle, speed=0.2, heading=0.7):
    """Preview of a motion whose velocity is `angle` off its heading."""
    window = preview(0, 4)
    direction = heading + angle
    velocity = np.tile([speed * np.cos(direction), speed * np.sin(direction), 0.3], (4, 1))
    velocity[:2] = 0.0
    return replace(window, pose=np.tile([1.0, 2.0, heading], (4, 1)), velocity=velocity)


@pytest.mark.parametrize("angle", [0.0, np.pi, 0.09, -0.09, np.pi - 0.09, 7 * np.pi])
def test_forwards_and_backwards_with_small_angles_can_be_followed(angle):
    turned(angle).check_heading()


@pytest.mark.parametrize("angle", [0.11, -0.11, np.pi / 2, np.pi - 0.11, -2.0])
def test_a_heading_across_the_velocity_is_refused_with_numbers(angle):
    off = np.degrees(abs(np.arctan(np.tan(angle))) if abs(np.cos(angle)) > 1e-9 else np.pi / 2)
    with pytest.raises(ValueError, match="point 3 moves sideways") as error:
        turned(angle).check_heading()
    assert f"0.2 m/s is {off:.3g}° off its heading of 0.7 rad" in str(error.value)


def test_any_heading_will_do_at_rest():
    turned(np.pi / 2, speed=0.0).check_heading()
    turned(np.pi / 2, speed=0.004).check_heading()


@pytest.mark.parametrize("reverse_gear", [False, True])
def test_what_is_planned_here_never_moves_sideways(reverse_gear):
    trajectory = Trajectory(Ellipse(), RestToRest(ramp_time=1.0), reverse_gear)
    times = np.arange(0, 200) * PERIOD
    r = trajectory.at(times * 1e-9)
    Preview(times, r.pose, r.velocity, r.acceleration).check_heading()
