"""What docs/theory.md, §5.4, says of the guidance law's stability."""

import numpy as np
import pytest
from scipy.optimize import brentq

from climber_uk.control.constraint_set import demanded
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics.climber import State
from climber_uk.mechanics.reference import Reference

CLIMBER_YAML = Guidance(frequency=11.0, cross_track_gain=12.0, fade_speed=0.1)


def steering(gains, v_d):
    steep = gains.cross_track_gain * v_d
    too_fast = steep * v_d / (2 / 3 * gains.frequency)
    return steep / np.sqrt(v_d**2 + gains.fade_speed**2 + too_fast**2)


def on_a_circle(v_d, omega_d):
    """Reference (N,) at the origin, along x, that goes round at constant speed."""
    zero = 0.0 * (v_d + omega_d)
    return Reference(
        pose=np.stack([zero, zero, zero], axis=-1),
        velocity=np.stack([v_d + zero, zero, omega_d + zero], axis=-1),
        acceleration=np.stack([zero, v_d * omega_d + zero, zero], axis=-1),
        jerk=np.stack([-v_d * omega_d**2 + zero, zero], axis=-1),
    )


def state_at(gains, v_d, e_x, e_y, speed, yaw_rate):
    """State with the heading that leads back, ψ = 0."""
    heading = -np.arctan(steering(gains, v_d) * e_y)
    return State.rolling(np.stack([e_x, e_y, heading], axis=-1), speed, yaw_rate)


def wanted_speed(gains, v_d, e_x):
    """w = v_d - L tanh(k_x e_x / L) [m/s]."""
    half = gains.fade_speed / 2
    behind = np.minimum(gains.catch_up_share * np.abs(v_d), gains.catch_up_speed)
    limit = np.hypot(np.where(e_x * v_d > 0, v_d, behind), half)
    return v_d - limit * np.tanh(gains.frequency / (2 * gains.damping) * e_x / limit)


def approach(gains, v_d, e_x, e_y, omega_d):
    """d/dt of (e_x² + e_y²)/2 on ψ = 0, v = w: by kinematics."""
    wanted = wanted_speed(gains, v_d, e_x)
    still = state_at(gains, v_d, e_x, e_y, 0.0 * e_x, omega_d)
    of_the_law = demanded(gains, still, on_a_circle(v_d, omega_d)).speed
    np.testing.assert_allclose(of_the_law, wanted, rtol=1e-9, atol=1e-12)
    state = state_at(gains, v_d, e_x, e_y, wanted, omega_d)
    v_x, v_y, _ = np.moveaxis(state.velocity, -1, 0)
    return e_x * (v_x - v_d + omega_d * e_y) + e_y * (v_y - omega_d * e_x)


def largest_approach(gains, slowest, fastest, radius, where=(-np.pi, np.pi)):
    """Largest of it over a disc of `radius` over g, for references of v_s times these speeds."""
    rng, n = np.random.default_rng(3), 300_000
    v_d = gains.fade_speed * rng.uniform(slowest, fastest, n)
    distance = radius / steering(gains, v_d) * np.sqrt(rng.uniform(1e-4, 1, n))
    angle = rng.uniform(*where, n)
    e_x, e_y = distance * np.cos(angle), distance * np.sin(angle)
    return approach(gains, v_d, e_x, e_y, rng.normal(size=n)).max()


@pytest.mark.parametrize(
    ("gains", "slowest"),
    [
        (Guidance(), 1.0),
        (Guidance(frequency=12.0, damping=1.0, cross_track_gain=0.54), 1.0),  # k_y v_s / k_x = 0.09
        (Guidance(cross_track_gain=3.3, fade_speed=0.2), 1.2),  # 0.051
        (CLIMBER_YAML, 1.0),
    ],
)
def test_the_distance_shrinks_within_twice_the_look_ahead(gains, slowest):
    assert largest_approach(gains, slowest, 12.0, 2.0) < 0


@pytest.mark.parametrize("gains", [Guidance(), CLIMBER_YAML, Guidance(cross_track_gain=9.0)])
def test_behind_a_reference_of_any_speed_it_does_so_with_any_gains(gains):
    assert largest_approach(gains, 0.05, 12.0, 2.0, (np.pi / 2, 3 * np.pi / 2)) < 0


@pytest.mark.parametrize(("speed", "radius"), [(0.5, 1.48), (0.3, 0.6), (0.2, 0.35)])
def test_ahead_of_a_slower_reference_the_disc_is_smaller(speed, radius):
    assert largest_approach(Guidance(), speed, speed, radius) < 0
    assert largest_approach(Guidance(), speed, speed, 1.1 * radius) > 0


def excess(gains, radius, v_d, e_y):
    """Speed along the circle that a climber going round inside needs, beyond what it is given."""
    g, curvature = steering(gains, v_d), 1 / radius
    e_x = -g * e_y * (1 - curvature * e_y) / curvature
    needed = v_d * (1 - curvature * e_y) * np.hypot(1, g * e_y)
    omega_d = v_d * curvature
    state = state_at(gains, v_d, e_x, e_y, needed, omega_d)
    return needed - demanded(gains, state, on_a_circle(v_d, omega_d))[2], state


def test_a_false_equilibrium_keeps_a_climber_on_a_circle_within_the_circle():
    gains, radius, v_d = Guidance(), 10.0, 10.0
    e_y = np.linspace(0.01, 0.99 * radius, 500)
    over = excess(gains, radius, v_d, e_y)[0]
    assert over.max() > 0
    last = np.flatnonzero(over > 0)[-1]
    there = brentq(lambda e: excess(gains, radius, v_d, np.array(e))[0], e_y[last], e_y[last + 1])
    _, state = excess(gains, radius, v_d, np.array(there))
    v_1, theta_2, *_ = demanded(gains, state, on_a_circle(v_d, v_d / radius))
    assert abs(v_1) < 1e-9
    assert abs(theta_2) < 1e-9
    assert np.hypot(*state.pose[:2]) > 5


@pytest.mark.parametrize("gains", [Guidance(), CLIMBER_YAML])
def test_there_is_no_false_equilibrium_where_the_look_ahead_is_long_beside_the_radius(gains):
    fastest = gains.catch_up_speed / gains.catch_up_share
    for radius in np.geomspace(0.01, 4, 12) / gains.cross_track_gain:
        for v_d in np.geomspace(0.01, fastest, 40):
            e_y = np.linspace(0.01, 0.99, 100) * radius
            assert excess(gains, radius, v_d, e_y)[0].max() < 0


@pytest.mark.parametrize(("gains", "nearest"), [(Guidance(), 1.3), (CLIMBER_YAML, 0.5)])
def test_no_false_equilibrium_is_near_the_reference(gains, nearest):
    for radius in np.geomspace(0.2, 20, 30):
        for v_d in np.geomspace(0.1, 12, 15):
            over, state = excess(gains, radius, v_d, np.linspace(0.005, 0.995, 200) * radius)
            there = np.flatnonzero(np.diff(np.sign(over)))
            assert np.all(np.hypot(*state.pose[there, :2].T) > nearest)


@pytest.mark.parametrize("gains", [Guidance(), CLIMBER_YAML])
def test_the_look_ahead_gets_longer_where_the_heading_could_not_follow(gains):
    speeds = np.geomspace(0.01, 30.0, 50)
    rates = speeds * [gains.steering(speed) for speed in speeds]
    assert np.all(np.diff(rates) > 0)
    assert rates[-1] == pytest.approx(gains.heading_frequency, rel=0.01)
    assert rates[-1] < gains.heading_frequency
