"""Messages to data: what is taken, and what is refused with its value and bound."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.messages.reading import MOST_TILT, NORM_TOLERANCE, heading_of, state

ANYTHING = settings(deadline=None)


def quaternion(heading, norm=1.0, tilt=0.0, about=0.0):
    """Of a turn by `heading` about z, then a tilt [rad] about an axis in the plane."""
    z, w, x, y = math.sin(heading / 2), math.cos(heading / 2), math.cos(about), math.sin(about)
    sine, cosine = math.sin(tilt / 2), math.cos(tilt / 2)
    parts = (
        sine * (x * w + y * z),
        sine * (y * w - x * z),
        cosine * z,
        cosine * w,
    )
    return tuple(norm * part for part in parts)


angles = st.floats(-math.pi, math.pi)


@ANYTHING
@given(
    heading=st.floats(-3.14, 3.14),
    norm=st.floats(1 - 0.999 * NORM_TOLERANCE, 1 + 0.999 * NORM_TOLERANCE),
    tilt=st.floats(0, 1.99 * math.asin(MOST_TILT)),
    about=angles,
    sign=st.sampled_from([-1, 1]),
)
def test_the_heading_is_taken_of_what_is_nearly_a_unit_turn_about_z(
    heading, norm, tilt, about, sign
):
    """Norms within the 1 % that tf2 takes, tilts up to 11°, either of the two quaternions."""
    turned = heading_of(*quaternion(heading, sign * norm, tilt, about))
    assert math.remainder(turned - heading, 2 * math.pi) == pytest.approx(0, abs=1e-12)


@ANYTHING
@given(heading=angles, off=st.floats(1.001 * NORM_TOLERANCE, 0.999), sign=st.sampled_from([-1, 1]))
def test_a_norm_that_is_further_off_is_refused(heading, off, sign):
    with pytest.raises(ValueError, match=r"must be a unit turn about z: norm .* from 0.99 to 1.01"):
        heading_of(*quaternion(heading, 1 + sign * off))


@ANYTHING
@given(heading=angles, tilt=st.floats(2.01 * math.asin(MOST_TILT), math.pi), about=angles)
def test_a_tilt_is_refused(heading, tilt, about):
    with pytest.raises(ValueError, match=r"hypot\(x, y\) .* < 0.1"):
        heading_of(*quaternion(heading, 1.0, tilt, about))


@pytest.mark.parametrize("axis", "xyzw")
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_an_orientation_that_is_not_finite_is_refused(axis, value):
    orientation = dict(zip("xyzw", quaternion(0.5), strict=True)) | {axis: value}
    with pytest.raises(ValueError, match="must be a unit turn about z"):
        heading_of(**orientation)


def test_what_says_nothing_of_a_climber_on_its_wall_may_be_anything():
    nothing = math.nan
    of = SimpleNamespace
    twist = of(linear=of(x=0.2, y=0.0, z=nothing), angular=of(x=nothing, y=nothing, z=0.1))
    message = of(
        header=of(frame_id="odom", stamp=of(sec=0, nanosec=0)),
        child_frame_id="base_link",
        pose=of(
            pose=of(
                position=of(x=1.0, y=2.0, z=nothing),
                orientation=of(**dict(zip("xyzw", quaternion(0.5, 1.002), strict=True))),
            ),
            covariance=[nothing] * 36,
        ),
        twist=of(twist=twist, covariance=[nothing] * 36),
    )
    found = state(message, "odom", "base_link")
    assert found.pose.tolist() == pytest.approx([1, 2, 0.5])
    assert found.velocity.tolist() == pytest.approx([0.2 * math.cos(0.5), 0.2 * math.sin(0.5), 0.1])
