import itertools
import math

import numpy as np
import pytest

from climber_uk.control.twist import TwistCheck
from climber_uk.mechanics.quantities import Motion

TIME = 0.1  # [s] from one odometry to the next
LARGEST = 0.05  # [m] by which ways may differ


def on_a_circle(speed, yaw_rate, heading, told):
    """Motion of ten odometry messages; `told` makes the twist of speed and yaw rate."""
    x, y, motions = 1.0, -2.0, []
    for _ in range(10):
        cosine, sine = math.cos(heading), math.sin(heading)
        motions.append(Motion(x, y, heading, cosine, sine, *told(speed, yaw_rate)))
        turned = yaw_rate * TIME
        chord = speed * TIME * (math.sin(turned / 2) / (turned / 2) if turned else 1.0)
        x += chord * math.cos(heading + turned / 2)
        y += chord * math.sin(heading + turned / 2)
        heading = math.remainder(heading + turned, math.tau)
    return motions


def troubles(motions, half_track=0.3):
    check, found = TwistCheck(), []
    for last, motion in itertools.pairwise(motions):
        check.add(last, motion, TIME, half_track)
        found.append(check.trouble(LARGEST))
    return found


@pytest.mark.parametrize("heading", [0.3, 1.8, -2.5])
@pytest.mark.parametrize(("speed", "yaw_rate"), [(1.0, 0.0), (2.0, 9.0), (-2.0, -9.0), (0.0, 3.0)])
def test_a_twist_that_is_the_rate_of_its_pose_is_no_trouble(heading, speed, yaw_rate):
    found = troubles(on_a_circle(speed, yaw_rate, heading, lambda *twist: twist))
    assert set(found) == {("", False)}


@pytest.mark.parametrize(
    ("told", "name"),
    [
        (lambda v, turn: (-v, turn), "twist.linear.x"),
        (lambda v, turn: (v, -turn), "twist.angular.z"),
    ],
    ids=["speed", "yaw rate"],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_wrong_sign_is_told_the_third_time_in_a_row(told, name, sign):
    found = troubles(on_a_circle(sign * 0.11, sign * 0.5, 0.3, told))
    assert [is_sign for _, is_sign in found[:3]] == [False, False, True]
    assert found[2] == (name, True)


@pytest.mark.parametrize("leap", [0.03, -0.03])
def test_a_pose_that_leaps_as_a_fix_corrects_it_tells_nothing_of_a_sign(leap):
    """It creeps on, and goes back to its path after each leap, as a controller has it."""
    check, x, speed = TwistCheck(), 0.0, 0.02
    last = Motion.at(x, 0.0, 0.0, speed, 0.0)
    for number in range(1, 400):
        leaps = leap if number % 40 == 0 else 0.0
        speed = 0.02 - leap / 0.2 * (number >= 40 and number % 40 < 20)
        x += 0.005 * (last.speed + speed) / 2 + leaps
        now = Motion.at(x, 0.0, 0.0, speed, 0.0)
        check.add(last, now, 0.005, 0.3)
        assert check.trouble(LARGEST)[1] is False
        last = now


@pytest.mark.parametrize("share", [0.0, 0.5, 2.0])
def test_a_twist_that_is_off_by_much_is_told_with_the_length(share):
    found = troubles(on_a_circle(1.0, 0.0, 0.3, lambda v, turn: (share * v, turn)))
    detail, is_sign = found[0]  # 0.1 m by pose, and as much as the share by twist
    off = abs(1 - share) * 0.1 - 0.3 * max(1, share) * 0.1
    assert (detail, is_sign) == ((f"by {off:.2f} m" if off > LARGEST else ""), False)
    assert all(detail for detail, _ in found[3:])


def test_a_twist_that_is_off_by_a_little_is_slip():
    found = troubles(on_a_circle(1.0, 0.0, 0.3, lambda v, turn: (1.3 * v, turn)))
    assert set(found) == {("", False)}


@pytest.mark.parametrize(("aside", "is_far"), [(0.25, False), (-0.25, False), (0.4, True)])
def test_what_turns_about_another_point_than_its_centre_does_not_go_sideways(aside, is_far):
    check, motions = TwistCheck(), []
    for time in TIME * np.arange(50):
        x, y = aside * math.cos(time), aside * math.sin(time)
        cosine, sine = math.cos(time), math.sin(time)  # across the way
        motions.append(Motion(x, y, float(time), cosine, sine, 0.0, 1.0))
    for last, motion in itertools.pairwise(motions):
        check.add(last, motion, TIME, 0.3)
    assert bool(check.sideways(LARGEST)) is is_far


def test_a_pose_that_leaps_aside_does_not_go_that_way():
    check = TwistCheck()
    at = [Motion(x, 0.0, math.pi / 2, 0.0, 1.0, 0.0, 0.0) for x in (0.0, 0.0, 0.1, 0.1, 0.1)]
    for last, motion in itertools.pairwise(at):
        check.add(last, motion, TIME, 0.3)
        assert not check.sideways(LARGEST)
