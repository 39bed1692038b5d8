import math

import numpy as np
import pytest

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.wall import WALLS, Cylinder, Plane


@pytest.mark.parametrize("inclination", [0.0, 30.0, 90.0, 180.0])
def test_on_the_default_plane_the_weight_is_the_climbers_to_the_last_bit(inclination):
    climber = Climber(inclination=inclination)
    x, y = Plane().along(inclination, 3.7)
    assert x == 0
    assert climber.mass * GRAVITY * y == -climber.weight_along_wall
    assert Plane().into(inclination, 3.7, 0.0) == climber.gravity_into_wall


@pytest.mark.parametrize(
    ("tilt", "downhill"), [(0, (0, -1)), (90, (1, 0)), (-90, (-1, 0)), (180, (0, 1))]
)
def test_a_tilt_turns_downhill_anticlockwise(tilt, downhill):
    np.testing.assert_allclose(Plane(float(tilt)).along(90.0, 0.0), downhill, atol=1e-15)


def test_a_pipe_is_climbed_from_its_floor_to_its_ceiling_and_down_the_other_side():
    pipe = Cylinder(radius=2.0)
    heights = 2.0 * np.radians([0, 90, 180, 270])
    x, y = pipe.along(0.0, heights)
    np.testing.assert_allclose(x, 0)
    np.testing.assert_allclose(y, [0, -1, 0, 1], atol=1e-15)
    into = pipe.into(0.0, heights, 0.0)
    np.testing.assert_allclose(into, [GRAVITY, 0, -GRAVITY, 0], atol=1e-14)


def test_outside_a_tank_the_way_up_leads_to_its_top():
    top = 2.0 * math.pi / 2
    assert Cylinder(radius=-2.0).into(90.0, top, 0.0) == pytest.approx(GRAVITY)


@pytest.mark.parametrize("radius", [2.0, -2.0])
def test_gravity_along_the_cylinder_is_the_slope_of_its_height(radius):
    # height above the axis: -R cos(inclination + y/R)
    y, step = 0.7, 1e-6

    def height(y):
        return -radius * math.cos(math.radians(40.0) + y / radius)

    slope = (height(y + step) - height(y - step)) / (2 * step)
    assert Cylinder(radius).along(40.0, y)[1] == pytest.approx(-slope, rel=1e-8)


def test_a_curved_way_presses_inside_and_lifts_outside():
    # 3² / 2 = 4.5 m/s²
    assert Cylinder(2.0).into(90.0, 0.0, 3.0) == pytest.approx(4.5)
    assert Cylinder(-2.0).into(90.0, 0.0, 3.0) == pytest.approx(-4.5)
    assert Plane().into(90.0, 0.0, 3.0) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("name", WALLS)
def test_every_wall_broadcasts_as_it_computes_one(name):
    wall, heights = WALLS[name](), np.linspace(-4, 4, 7)
    for part, alone in (
        (wall.along(70.0, heights)[1], lambda y: wall.along(70.0, y)[1]),
        (wall.into(70.0, heights, 0.3), lambda y: wall.into(70.0, y, 0.3)),
    ):
        np.testing.assert_allclose(part, [alone(y) for y in heights.tolist()])


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"radius=0.0 must not be 0 \[m\]"):
        Cylinder(radius=0.0)
    with pytest.raises(ValueError, match=r"tilt=200.0 must be <= 180 \[deg\]"):
        Plane(tilt=200.0)
