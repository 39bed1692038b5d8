"""Motions that are made by hand, and closed loops with noise, against parameters that are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from climber_uk.analysis.identification import identify
from climber_uk.analysis.identification_experiments import (
    SCENARIOS,
    as_identified,
    errors,
    identified,
    truth,
)
from climber_uk.analysis.identification_report import changes, missing, remarks
from climber_uk.analysis.integral_equations import Cut
from climber_uk.analysis.recorded_motion import RecordedMotion, impulse, stretches
from climber_uk.mechanics.climber import Climber

TRUE = Climber(mass=6.5, yaw_inertia=0.25, seal_friction_coefficient=0.7, wheel_radius=0.03)
BELIEVED = Climber()
TIME = np.arange(0.0, 20.0, 0.005)
PULSING = 0.3 + 0.15 * np.sin(TIME), 0.15 * np.cos(TIME)  # speed and its rate
WINDING = 1.5 * np.sin(0.8 * TIME), 1.2 * np.cos(0.8 * TIME), -0.96 * np.sin(0.8 * TIME)
STEADY = 0.3 + 0 * TIME, 0 * TIME
STRAIGHT = 0 * TIME, 0 * TIME, 0 * TIME  # to the right


def since_start(values):
    return cumulative_trapezoid(values, TIME, axis=0, initial=0)


def moved(
    speed=PULSING,
    heading=WINDING,
    true=TRUE,
    viscous=0.0,
    turning=0.0,
    wheels=False,
    noise=0.0,
    seed=0,
):
    """Motion as (11) and (15) have it, written out; `noise` in mm, mrad, cm/s and crad/s."""
    (v, v_1), (theta, omega, omega_1) = speed, heading
    m, J, r, d = true.mass, true.yaw_inertia, true.wheel_radius, true.half_track
    rubs = (1 - true.wheel_load_share) * true.suction_pressure * true.suction_area
    rubs *= true.seal_friction_coefficient
    pull = m * 9.81 * np.sin(np.radians(true.inclination)) * np.sin(theta)
    drive = m * v_1 + rubs * np.sign(v) + viscous * v + pull
    turn = J * omega_1 + turning * omega
    torques = r / 2 * np.column_stack([drive + turn / d, drive - turn / d])
    random = np.random.default_rng(seed).normal(size=(5, len(TIME))) * noise
    way = since_start(np.column_stack([v * np.cos(theta), v * np.sin(theta)])).T
    return RecordedMotion(
        time=TIME,
        pose=np.column_stack([*(way + 1e-3 * random[:2]), theta + 1e-3 * random[2]]),
        rates=np.column_stack([v, omega]) + 1e-2 * random[3:].T,
        impulse=since_start(torques),
        pressure=np.full(len(TIME), true.suction_pressure),
        stretch=np.zeros(len(TIME), int),
        wheel_angles=since_start(np.column_stack([v + d * omega, v - d * omega]) / r)
        if wheels
        else None,
    )


def said_of(found):
    return " ".join([*remarks(found), *missing(found)])


def test_every_parameter_is_found_from_a_motion_that_shows_it():
    found = identify(moved(viscous=20.0, turning=0.05, wheels=True), BELIEVED)
    for name in ("mass", "yaw_inertia", "wheel_radius", "half_track"):
        assert found[name] == pytest.approx(getattr(TRUE, name), rel=1e-4)
    # smoothing over 2 h takes h² ω²/6 of what changes with ω = 1 rad/s
    assert found["seal_friction_coefficient"] == pytest.approx(0.7, rel=1e-3)
    assert found["viscous_friction"] == pytest.approx(20.0, rel=2e-3)
    assert found["turning_resistance"] == pytest.approx(0.05, rel=2e-3)
    assert found.known.all()


def test_without_wheel_angles_radius_and_track_are_taken_as_they_are():
    believed = replace(BELIEVED, wheel_radius=0.03)
    found = identify(moved(), believed)
    assert found["mass"] == pytest.approx(6.5, rel=1e-4)
    assert (found["wheel_radius"], found["half_track"]) == (0.03, 0.3)
    assert "joint_states has no wheel angles" in said_of(found)


def test_what_is_not_there_is_found_to_be_about_zero():
    covered = 0
    for seed in range(6):
        found = identify(moved(noise=1.0, seed=seed), replace(BELIEVED, wheel_radius=0.03))
        assert abs(found["viscous_friction"]) * found.extent.speed < 0.005 * found.extent.drive
        assert abs(found["turning_resistance"]) * found.extent.yaw_rate < 0.005 * found.extent.turn
        covered += sum(not found.is_clear(n) for n in ("viscous_friction", "turning_resistance"))
    assert covered >= 10


def test_speeds_may_be_missing():
    motion = replace(moved(noise=1.0, wheels=True), rates=None)
    found = identify(motion, BELIEVED)
    assert found["mass"] == pytest.approx(6.5, rel=0.02)
    assert found["yaw_inertia"] == pytest.approx(0.25, rel=0.02)


def test_driving_backwards_is_a_motion_like_any_other():
    speed, faster = PULSING
    found = identify(moved(speed=(-speed, -faster), wheels=True), BELIEVED)
    assert found["seal_friction_coefficient"] == pytest.approx(0.7, rel=1e-3)
    assert found["mass"] == pytest.approx(6.5, rel=1e-3)


def test_a_steady_straight_drive_does_not_tell_mass_and_friction_apart():
    found = identify(moved(STEADY, STRAIGHT, noise=1.0, wheels=True), BELIEVED)
    said = said_of(found)
    assert "mass and seal friction coefficient cannot be told apart from this bag: drive" in said
    assert "yaw inertia cannot be told from this bag: drive bends" in said
    assert "half track cannot be told" in said
    changed = changes(found, BELIEVED)["uk_torque_controller"]
    assert changed == {"wheel_radius": pytest.approx(0.03, rel=1e-3)}


def test_exact_numbers_do_not_make_a_steady_straight_drive_tell_more():
    found = identify(moved(STEADY, STRAIGHT, wheels=True), BELIEVED)
    assert "mass and seal friction coefficient cannot be told apart" in said_of(found)


def test_at_one_speed_friction_is_told_as_a_whole():
    found = identify(moved(STEADY, WINDING, viscous=20.0, noise=1.0, wheels=True), BELIEVED)
    assert "viscous friction cannot be told apart from the seal's" in said_of(found)
    assert not list(missing(found))
    assert found["mass"] == pytest.approx(6.5, rel=0.01)
    assert found.friction == pytest.approx(0.7 * 0.47 * 150 + 20.0 * 0.3, rel=0.01)


def test_on_a_floor_it_is_changes_of_speed_that_tell_the_mass():
    true, believed = replace(TRUE, inclination=0.0), replace(BELIEVED, inclination=0.0)
    pulsing = 0.6 + 0.3 * np.sin(3 * TIME), 0.9 * np.cos(3 * TIME)
    found = identify(moved(pulsing, true=true, noise=1.0, wheels=True), believed)
    assert found["mass"] == pytest.approx(6.5, rel=0.02)
    steady = identify(moved(STEADY, true=true, noise=1.0, wheels=True), believed)
    assert "mass and seal friction coefficient cannot be told apart" in said_of(steady)


def test_friction_that_changes_with_the_pressure_is_one_coefficient():
    motion = moved(wheels=True)
    half = replace(TRUE, suction_pressure=TRUE.suction_pressure / 2)
    other = moved(true=half, wheels=True)
    middle = len(TIME) // 2
    later = np.arange(len(TIME)) >= middle
    jump = motion.impulse[middle] - other.impulse[middle]
    mixed = replace(
        motion,
        impulse=np.where(later[:, None], other.impulse + jump, motion.impulse),
        pressure=np.where(later, half.suction_pressure, TRUE.suction_pressure),
    )
    found = identify(mixed, BELIEVED)
    assert identify(mixed, replace(BELIEVED, wheel_radius=0.03))["mass"] == pytest.approx(6.5, 2e-3)
    assert found["seal_friction_coefficient"] == pytest.approx(0.7, rel=2e-3)


def test_odometry_that_jumps_now_and_then_spoils_little():
    motion = moved(noise=1.0, wheels=True)
    wrong = np.random.default_rng(2).random(len(TIME)) < 0.01
    found = identify(replace(motion, rates=motion.rates + 0.5 * wrong[:, None]), BELIEVED)
    assert found["mass"] == pytest.approx(6.5, rel=0.02)
    assert found["yaw_inertia"] == pytest.approx(0.25, rel=0.02)


def test_a_climber_that_hardly_moves_is_refused_with_what_there_has_to_be():
    with pytest.raises(ValueError, match=r"0 windows of 1\.0 s in motion must be >= 5"):
        identify(moved((0 * TIME, 0 * TIME), STRAIGHT), BELIEVED)
    with pytest.raises(ValueError, match=r"window=-1 must be > 0 \[s\]"):
        Cut(window=-1)


def test_a_window_has_one_direction_and_no_gap():
    motion = moved((0.3 * np.cos(0.5 * TIME), -0.15 * np.sin(0.5 * TIME)))
    motion = replace(motion, stretch=(TIME > 1.3).astype(int))
    windows = Cut().windows(motion)
    assert len(windows) >= 10
    for window in windows:
        assert abs(np.sign(motion.speed[window]).sum()) == len(window)
        assert len(set(motion.stretch[window])) == 1
        assert np.ptp(TIME[window]) >= 0.99


def test_an_impulse_is_that_of_torques_held():
    begins, torques = np.array([1.0, 2.0, 4.0]), np.array([[1.0, 0.0], [3.0, 2.0], [0.0, 0.0]])
    assert impulse(np.array([1.5, 3.0, 4.0]), begins, torques) == pytest.approx(
        np.array([[0.5, 0.0], [4.0, 2.0], [7.0, 4.0]])
    )


def test_a_gap_between_torques_ends_a_stretch():
    begins = np.array([0.0, 0.1, 0.2, 0.3, 1.0, 1.1, 1.2])
    before, within, after = stretches(np.array([0.2, 0.5, 1.1]), begins)
    assert len({before, within, after}) == 3


def test_viscous_friction_goes_to_the_plant_as_such_and_to_the_controller_at_its_speed():
    changed = changes(identify(moved(viscous=20.0), replace(BELIEVED, wheel_radius=0.03)), BELIEVED)
    load = 0.47 * 150
    plant, controller = changed["plant_simulator"], changed["uk_torque_controller"]
    assert plant["friction"] == "stribeck"
    assert plant["stribeck.ratio"] == 1.0
    assert plant["stribeck.viscous"] == pytest.approx(20.0 / (0.7 * load), rel=3e-3)
    assert plant["seal_friction_coefficient"] == pytest.approx(0.7, rel=1e-3)
    speed = np.sqrt(np.mean(PULSING[0] ** 2))
    assert controller["seal_friction_coefficient"] == pytest.approx(
        0.7 + 20 * speed / load, rel=0.01
    )


SHORT = replace(SCENARIOS["paper.yaml"], duration=6.5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_noisy_closed_loop_tells_what_is_30_percent_off(seed):
    off, _ = errors(*identified(SHORT, seed))
    assert np.abs(off).max() < 0.02


@pytest.mark.slow
def test_a_controller_with_what_was_found_tracks_as_one_with_the_truth():
    true, found = identified(SHORT, 4)
    best = SHORT.tracks(true, true)
    assert SHORT.tracks(as_identified(SHORT.believed, found), true) <= 1.2 * best
    assert SHORT.tracks(SHORT.believed, truth(SHORT.believed, 4)) > 1.2 * best


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", SCENARIOS)
def test_intervals_hold_the_truth_as_often_as_they_say(name):
    results = [errors(*identified(SCENARIOS[name], seed)) for seed in range(100)]
    off, inside = (np.array(column) for column in zip(*results, strict=True))
    assert np.abs(off).max() < 0.02
    assert (inside.sum(axis=0) >= 90).all()
