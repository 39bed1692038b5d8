import math

import numpy as np
import pytest

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.wall import WALLS, Cone, Cylinder, Plane, Sphere, Tank


@pytest.mark.parametrize("inclination", [0.0, 30.0, 90.0, 180.0])
def test_on_the_default_plane_the_weight_is_the_climbers_to_the_last_bit(inclination):
    climber = Climber(inclination=inclination)
    x, y = Plane().along(inclination, 0.3, 3.7)
    assert x == 0
    assert climber.mass * GRAVITY * y == -climber.weight_along_wall
    assert Plane().into(inclination, 0.3, 3.7, 0.2, 0.0) == climber.gravity_into_wall


@pytest.mark.parametrize(
    ("tilt", "downhill"), [(0, (0, -1)), (90, (1, 0)), (-90, (-1, 0)), (180, (0, 1))]
)
def test_a_tilt_turns_downhill_anticlockwise(tilt, downhill):
    np.testing.assert_allclose(Plane(float(tilt)).along(90.0, 0.0, 0.0), downhill, atol=1e-15)


def test_a_pipe_is_climbed_from_its_floor_to_its_ceiling_and_down_the_other_side():
    pipe = Cylinder(radius=2.0)
    heights = 2.0 * np.radians([0, 90, 180, 270])
    x, y = pipe.along(0.0, 0.0 * heights, heights)
    np.testing.assert_allclose(x, 0)
    np.testing.assert_allclose(y, [0, -1, 0, 1], atol=1e-15)
    into = pipe.into(0.0, 0.0, heights, 0.0, 0.0)
    np.testing.assert_allclose(into, [GRAVITY, 0, -GRAVITY, 0], atol=1e-14)


def test_outside_a_tank_the_way_up_leads_to_its_top():
    top = 2.0 * math.pi / 2
    assert Cylinder(radius=-2.0).into(90.0, 0.0, top, 0.0, 0.0) == pytest.approx(GRAVITY)


@pytest.mark.parametrize("radius", [2.0, -2.0])
def test_gravity_along_the_cylinder_is_the_slope_of_its_height(radius):
    # height above the axis: -R cos(inclination + y/R)
    y, step = 0.7, 1e-6

    def height(y):
        return -radius * math.cos(math.radians(40.0) + y / radius)

    slope = (height(y + step) - height(y - step)) / (2 * step)
    assert Cylinder(radius).along(40.0, 0.0, y)[1] == pytest.approx(-slope, rel=1e-8)


def test_a_curved_way_presses_inside_and_lifts_outside():
    # 3² / 2 = 4.5 m/s²
    assert Cylinder(2.0).into(90.0, 0.0, 0.0, 0.0, 3.0) == pytest.approx(4.5)
    assert Cylinder(-2.0).into(90.0, 0.0, 0.0, 0.0, 3.0) == pytest.approx(-4.5)
    assert Plane().into(90.0, 0.0, 0.0, 0.0, 3.0) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("name", WALLS)
def test_every_wall_broadcasts_as_it_computes_one(name):
    wall, places = WALLS[name](), np.linspace(-4, 4, 7)

    def told(x, y):
        return *wall.along(70.0, x, y), wall.into(70.0, x, y, 0.2, 0.3)

    for part, alone in zip(told(places, places[::-1]), told_each(told, places), strict=True):
        np.testing.assert_allclose(part + 0 * places, alone)


def told_each(told, places):
    pairs = zip(places.tolist(), places[::-1].tolist(), strict=True)
    return np.array([told(x, y) for x, y in pairs]).T


def rotation(axis, angle):
    """Matrix (3, 3), by Rodrigues."""
    cross = np.cross(np.eye(3), axis)  # as a matrix: axis × …
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def on_ball(wall, inclination, x, y):
    """Place (3,) and frame (3, 3) of a point, rolled from the origin without turning."""
    steep = np.radians(inclination)
    # the frame at the origin: x, y along the wall, z off it
    frame = np.array(
        [[1, 0, 0], [0, np.cos(steep), np.sin(steep)], [0, -np.sin(steep), np.cos(steep)]]
    )
    direction = np.array([x, y]) if isinstance(wall, Sphere) else np.array([x, 0.0])
    far = np.linalg.norm(direction)
    if far == 0:
        return frame
    ahead = direction @ frame[:2] / far
    # inside (R > 0) the way turns up, towards the normal
    return frame @ rotation(np.cross(ahead, frame[2]), far / wall.radius).T


@pytest.mark.parametrize("kind", [Tank, Sphere])
@pytest.mark.parametrize("radius", [3.0, -3.0])
@pytest.mark.parametrize("inclination", [0.0, 40.0, 90.0, 130.0])
def test_gravity_on_what_is_round_is_that_of_a_frame_that_is_carried_along(
    kind, radius, inclination
):
    wall = kind(radius)
    for x, y in ((0.0, 0.0), (0.7, 0.0), (0.0, 1.1), (-0.8, 1.3), (2.0, -1.5)):
        s_x, s_y = wall.along(inclination, x, y)
        into = wall.into(inclination, x, y, 0.0, 0.0)
        down = on_ball(wall, inclination, x, y) @ np.array([0, 0, -1.0])
        np.testing.assert_allclose([s_x, s_y, -into / GRAVITY], down, atol=1e-12)


@pytest.mark.parametrize("distance", [4.0, -4.0])
@pytest.mark.parametrize("inclination", [30.0, 80.0, 120.0])
def test_gravity_on_a_cone_is_the_slope_of_its_height(distance, inclination):
    wall, step = Cone(distance), 1e-6

    def height(x, y):  # the distance to the apex, which unrolling keeps, is as steep everywhere
        climbed = np.hypot(x, distance - y) * np.sin(np.radians(inclination))
        return -climbed if distance > 0 else climbed

    for x, y in ((0.0, 0.0), (1.5, 0.3), (-0.4, -2.0)):
        slope = [
            (height(x + step, y) - height(x - step, y)) / (2 * step),
            (height(x, y + step) - height(x, y - step)) / (2 * step),
        ]
        np.testing.assert_allclose(wall.along(inclination, x, y), np.negative(slope), atol=1e-8)


def test_around_a_cone_its_circles_press_or_lift():
    # a roof of 60°, 4 m below its apex: circles of 2 m; 1 m/s there is 0.5 m/s², of which
    # sin 60° is across the roof, off it
    off = GRAVITY * 0.5 - Cone(4.0).into(60.0, 0.0, 0.0, 1.0, 0.0)
    assert off == pytest.approx(0.5 * math.sin(math.radians(60)))
    assert Cone(-4.0).into(60.0, 0.0, 0.0, 1.0, 0.0) == pytest.approx(GRAVITY * 0.5 + off)
    assert Cone(4.0).into(60.0, 0.0, 0.0, 0.0, 1.0) == pytest.approx(GRAVITY * 0.5)


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"radius=0.0 must not be 0 \[m\]"):
        Cylinder(radius=0.0)
    for kind in (Tank, Sphere):
        with pytest.raises(ValueError, match="must not be 0"):
            kind(radius=0.0)
    with pytest.raises(ValueError, match=r"distance=0.0 must not be 0 \[m\]"):
        Cone(distance=0.0)
    with pytest.raises(ValueError, match=r"tilt=200.0 must be <= 180 \[deg\]"):
        Plane(tilt=200.0)
