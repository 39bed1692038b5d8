"""Walls in space, as the example for MuJoCo has them, beside those of our mechanics, unrolled."""

import sys
from pathlib import Path

import numpy as np
import pytest

from climber_uk.mechanics.climber import DEGREE, GRAVITY
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from mujoco_wall import surface

WALLS = [
    (Plane(), 80.0),
    (Tank(-5.0), 60.0),
    (Tank(4.0), 90.0),
    (Cylinder(-5.0), 90.0),
    (Cylinder(0.6), 30.0),
    (Sphere(5.0), 90.0),
    (Sphere(-5.0), 40.0),
    (Cone(6.0), 70.0),
    (Cone(6.0), 110.0),
    (Cone(-6.0), 70.0),
    (Cone(-6.0), 110.0),
]
PLACES = np.random.default_rng(1).uniform(-1.5, 1.5, (30, 2))
STEP = 1e-3  # [m]


def stretched(wall):
    """By how much of itself a length on the wall is longer, unrolled: of a sphere."""
    square = (PLACES**2).sum(axis=1).max()
    return square / (6 * wall.radius**2) if isinstance(wall, Sphere) else 0.0


@pytest.fixture(params=WALLS, ids=str)
def walls(request):
    wall, inclination = request.param
    return wall, inclination, surface(wall, inclination)


def test_what_is_over_a_place_has_it_under_it(walls):
    *_, space = walls
    points, frames = space.at(PLACES)
    heights = np.linspace(-0.1, 0.1, len(PLACES))[:, None]
    np.testing.assert_allclose(space.under(points + heights * frames[:, :, 2]), PLACES, atol=1e-12)


def test_frames_are_rotations_and_tangent(walls):
    wall, _, space = walls
    _, frames = space.at(PLACES)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    for way, axis in zip(np.eye(2), np.moveaxis(frames, 2, 0), strict=False):
        ahead, behind = (space.at(PLACES + sign * STEP * way)[0] for sign in (1, -1))
        along = (ahead - behind) / (2 * STEP)
        np.testing.assert_allclose(along, axis, atol=1e-6 + stretched(wall))


def test_gravity_is_that_of_the_wall_unrolled(walls):
    wall, inclination, space = walls
    _, frames = space.at(PLACES)
    steep = inclination * DEGREE
    down = np.array([0.0, -np.sin(steep), -np.cos(steep)]) @ frames
    s_x, s_y = wall.along(inclination, *PLACES.T)
    into = wall.into(inclination, *PLACES.T, 0.0, 0.0)
    np.testing.assert_allclose(down, np.stack([s_x, s_y, -into / GRAVITY], axis=1), atol=1e-12)


@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8)])
def test_a_way_bends_as_much_as_it_presses_a_climber_onto_the_wall(walls, way):
    wall, inclination, space = walls
    before, here, after = (space.at(PLACES + time * np.array(way))[0] for time in (-STEP, 0, STEP))
    _, frames = space.at(PLACES)
    bent = np.einsum("ni,ni->n", before - 2 * here + after, frames[:, :, 2]) / STEP**2
    moving, resting = (
        wall.into(inclination, *PLACES.T, *(speed * np.array(way))) for speed in (1.0, 0.0)
    )
    # a curvature, 1/R of a sphere, goes with the square of what is a length too long
    np.testing.assert_allclose(bent, moving - resting, atol=2e-6 + 2 * stretched(wall) / 5)


def test_around_a_wall_it_comes_back():
    space = surface(Cylinder(0.6), 0.0)
    _, turn = space.turn
    here, around = space.at(np.array([[0.3, 0.2], [0.3, 0.2 + turn]]))[0]
    np.testing.assert_allclose(here, around, atol=1e-12)


class Unknown:
    """A wall of another package."""


def test_a_wall_that_is_not_known_is_refused_by_name():
    with pytest.raises(ValueError, match="wall: Unknown is not in this model"):
        surface(Unknown(), 90.0)
