"""Names in messages: joints of the wheels, one a side or more, and frames."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.messages import reading
from climber_uk.messages.names import Names, wheel_joints

SIDES = {1: ("l", "r"), 2: ("lf, lr", "rf,rr"), 3: ("a,b , c", "d, e, f")}
numbers = st.floats(-100, 100)


@given(number=st.sampled_from([1, 2, 3]), left=numbers, right=numbers, seed=st.randoms())
def test_what_is_told_of_the_sides_is_read_in_any_order(number, left, right, seed):
    joints = wheel_joints(*SIDES[number])
    assert len(joints.left) == len(joints.right) == number
    for what, told in (("efforts", joints.torques), ("velocities", joints.rates)):
        pairs = list(zip(joints.all, told(left, right), strict=True))
        seed.shuffle(pairs)
        names, values = zip(*pairs, strict=True)
        read = reading.wheel_torques(reading.JointFields(0, 0, values, names), joints, what)
        assert read == pytest.approx((right, left))


@pytest.mark.parametrize(
    ("left", "right"), [("", "r"), ("l", "l"), ("a, a", "b"), ("a,", "b"), ("a, b", "b, c")]
)
def test_joints_that_are_missing_or_twice_there_are_refused(left, right):
    with pytest.raises(ValueError, match="must name each joint once"):
        Names(left_wheel_joint=left, right_wheel_joint=right)


def test_a_message_without_all_of_them_is_refused_by_name():
    fields = reading.JointFields(0, 0, [1.0, 2.0], ["lf", "rf"])
    with pytest.raises(ValueError, match="must be 'lf', 'lr', 'rf' and 'rr'"):
        reading.wheel_torques(fields, wheel_joints(*SIDES[2]))


@pytest.mark.parametrize(
    ("namespace", "prefixes", "frames"),
    [
        ("/", True, ("odom", "base")),
        ("/left", True, ("left/odom", "left/base")),
        ("/north/left", True, ("north/left/odom", "north/left/base")),
        ("/left", False, ("odom", "base")),
    ],
)
def test_frames_begin_with_the_namespace_unless_told_not_to(namespace, prefixes, frames):
    names = Names(odom_frame="odom", base_frame="base", prefix_frames=prefixes).within(namespace)
    assert (names.odom_frame, names.base_frame) == frames
