"""Motions that are made by hand, and closed loops with noise, against parameters that are known."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from identification_experiments import (
    SCENARIOS,
    as_identified,
    errors,
    identified,
    scrub_error,
    truth,
)
from scipy.integrate import cumulative_trapezoid

from climber_uk.identification.estimation import identify
from climber_uk.identification.integral_equations import Cut, Site
from climber_uk.identification.recorded_motion import RecordedMotion, impulse, stretches
from climber_uk.identification.report import changes, missing, remarks, rows, table
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.wall import Cylinder

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
    scrub=0.0,
    lacking=(0.0, 0.0),
    effective=1.0,
    rolls=1.0,
):
    """Motion as (11) and (15) have it, written out; `noise` in mm, mrad, cm/s and crad/s.

    `lacking` are a force and a moment that the equations do not have, and wheels turn as if the
    half track were `effective` times what it is.
    """
    (v, v_1), (theta, omega, omega_1) = speed, heading
    m, J, r, d = true.driven_mass, true.driven_inertia, true.wheel_radius, true.half_track
    rubs = (1 - true.wheel_load_share) * true.suction_pressure * true.suction_area
    rubs *= true.seal_friction_coefficient
    pull = true.mass * 9.81 * np.sin(np.radians(true.inclination)) * np.sin(theta)
    drive = m * v_1 + rubs * np.sign(v) + viscous * v + pull + lacking[0]
    turn = J * omega_1 + scrub * np.sign(omega) + turning * omega + lacking[1]
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
        wheel_angles=since_start(
            np.column_stack([rolls * v + side * effective * d * omega for side in (1, -1)]) / r
        )
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
    assert [*found.reasons] == ["rotor_inertia"]  # there is none


@pytest.mark.parametrize(
    ("inertia", "assumed"),
    [
        # 0.7 to 22 kg at the rims
        pytest.param(*it, marks=() if it in [(3e-4, 0.0), (1e-2, 1e-3)] else pytest.mark.soak)
        for it in itertools.product((3e-4, 1e-3, 1e-2), (0.0, 1e-3))
    ],
)
def test_rotors_are_told_from_mass_as_they_have_no_weight(inertia, assumed):
    true = replace(TRUE, rotor_inertia=inertia)
    found = identify(
        moved(true=true, wheels=True, noise=1.0), replace(BELIEVED, rotor_inertia=assumed)
    )
    assert "rotor_inertia" not in found.reasons
    assert found["rotor_inertia"] == pytest.approx(inertia, abs=0.02 * inertia + 5e-5)
    for name in ("mass", "yaw_inertia"):
        assert found[name] == pytest.approx(getattr(true, name), rel=0.05)
        assert abs(found[name] - getattr(true, name)) <= 1.5 * found.half_width(name), name


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
        extent = found.extent
        assert abs(found["viscous_friction"]) * extent.speed < 0.005 * extent.force
        assert abs(found["turning_resistance"]) * extent.yaw_rate < 0.005 * extent.moment
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
    with pytest.raises(ValueError, match=r"window=-1 must be >= 0.02 \[s\]"):
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


TRUTH = {
    "mass": TRUE.mass,
    "seal_friction_coefficient": TRUE.seal_friction_coefficient,
    "viscous_friction": 0.0,
    "yaw_inertia": TRUE.yaw_inertia,
    "turning_friction": 0.0,
    "turning_resistance": 0.0,
    "wheel_radius": TRUE.wheel_radius,
    "half_track": TRUE.half_track,
}


def wrong(found, widths=1.6, **others):
    """Names of what is told, and off by more than so many half widths: of 95 %, if one is meant."""
    truth = {**TRUTH, **others}
    told = [name for name in truth if name not in found.reasons and truth[name] is not None]
    off = {name: abs(found[name] - truth[name]) for name in told}
    return [name for name in told if off[name] > widths * found.half_width(name)]


@pytest.mark.parametrize("believed", [0.1, pytest.param(0.33, marks=pytest.mark.soak), 1.0])
def test_inertia_under_friction_that_resists_turning_is_not_what_was_believed(believed):
    true = replace(TRUE, yaw_inertia=0.38)
    motion = moved(true=true, scrub=40.0, noise=1.0, wheels=True)
    found = identify(motion, replace(BELIEVED, yaw_inertia=believed))
    assert found["yaw_inertia"] == pytest.approx(0.38, rel=0.01)
    assert found["turning_friction"] == pytest.approx(40.0, rel=0.001)
    assert not wrong(found, yaw_inertia=0.38, turning_friction=40.0)
    assert "turning is resisted, by 40" in said_of(found)


@pytest.mark.parametrize("believed", [0.1, pytest.param(0.33, marks=pytest.mark.soak), 1.0])
def test_what_is_not_excited_is_not_what_was_believed_but_has_no_number(believed):
    believed = replace(BELIEVED, yaw_inertia=believed)
    for heading in (STRAIGHT, (0.3 * TIME, 0.3 + 0 * TIME, 0 * TIME)):  # nor in a steady bend
        found = identify(moved(heading=heading, noise=1.0, wheels=True), believed)
        (row,) = (row for row in rows(found, believed) if row["parameter"] == "yaw_inertia")
        assert (row["estimate"], row["half_width"], row["known"]) == (None, None, False)
        assert row["cause"] in ("not excited", "collinear")
        assert "yaw_inertia" not in changes(found, believed)["uk_torque_controller"]
        assert "yaw inertia cannot be told from this bag: drive bends" in said_of(found)


def test_nearly_the_same_speed_is_no_reason_to_tell_one_friction_for_both():
    found = identify(moved(STEADY, viscous=20.0, noise=1.0, wheels=True), BELIEVED)
    told = {row["parameter"]: row for row in rows(found, BELIEVED)}
    for name in ("seal_friction_coefficient", "viscous_friction"):
        assert not told[name]["known"]
        assert "speeds hardly differ: together 55" in told[name]["reason"]


def test_what_scrubbing_wheels_drive_is_off_by_some_percent_and_that_is_no_viscous_friction():
    speed = 0.3 + 0.05 * np.sin(TIME), 0.05 * np.cos(TIME)
    lacking = 1.5 * np.sin(TIME), 0.0  # [N] of 50 N of friction
    motion = moved(speed, lacking=lacking, scrub=30.0, effective=1.2, noise=1.0, wheels=True)
    found = identify(motion, BELIEVED)
    told = {row["parameter"]: row for row in rows(found, BELIEVED)}
    for name in ("seal_friction_coefficient", "viscous_friction"):
        assert not told[name]["known"], told[name]
        assert "together 49" in told[name]["reason"]


def test_a_moment_that_hides_the_inertia_is_told_all_the_same():
    round_and_round = 0.3 * TIME, 0.3 + 0 * TIME, 0 * TIME
    motion = moved(heading=round_and_round, scrub=30.0, effective=1.2, noise=1.0, wheels=True)
    found = identify(motion, replace(BELIEVED, yaw_inertia=0.5))
    assert {"yaw_inertia", "turning_friction", "turning_resistance"} <= found.reasons.keys()
    (row,) = (row for row in rows(found, BELIEVED) if row["parameter"] == "turning_moment")
    assert row["estimate"] == pytest.approx(30.0, abs=1.5 * row["half_width"] + 0.01)
    assert row["half_width"] < 0.5
    assert "turning is resisted, by 30" in said_of(found)
    assert "wheels scrub: their angles show an effective one of 0.36" in table(found, BELIEVED)


THETA, OMEGA, _ = WINDING
HEIGHT = since_start(PULSING[0] * np.sin(THETA))
# A force and a moment that the equations lack, by what they come from.
LACKING = {
    "a tilted wall": (6.0 * np.cos(THETA), 0.0),
    "a round wall": (-64.0 * np.sin(THETA) * HEIGHT / 4, 0.0),
    "scrubbing wheels": (8.0 * np.abs(OMEGA), 0.0),
    "wear": (0.4 * TIME, 0.0),
    "more friction at rest": (20.0 * np.exp(-((PULSING[0] / 0.15) ** 2)), 0.0),
    "friction that grows with the square": (100.0 * PULSING[0] ** 2, 0.0),
    "a place that is rougher": (5.0 * (np.sin(0.9 * TIME) > 0.5), 0.0),
    "a centre of mass beside": (0.0, 1.5 * np.cos(THETA)),
    "a ring": (0.0, 2.0 * OMEGA / np.hypot(OMEGA, 0.5)),
    "unlike motors": (0.0, 0.4 + 0 * TIME),
    "a moment that grows with the square": (0.0, OMEGA * np.abs(OMEGA)),
    "a rough place that turns": (0.0, 0.3 * (np.sin(0.9 * TIME) > 0.5)),
}


@pytest.mark.parametrize("scrub", [30.0, pytest.param(0.0, marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if number % 3 == 0 else pytest.mark.soak)
        for number, name in enumerate(LACKING)
    ],
)
def test_what_the_equations_lack_is_said_and_makes_no_number_wrong(name, scrub):
    motion = moved(lacking=LACKING[name], scrub=scrub, noise=1.0, wheels=True)
    found = identify(motion, BELIEVED)
    what = "drive" if np.any(LACKING[name][0]) else "yaw"
    of_turning = {"turning_friction": None, "turning_resistance": None}
    of_driving = {"seal_friction_coefficient": None, "viscous_friction": None}
    truth = of_turning if what == "yaw" else {"turning_friction": scrub}
    if "friction" in name:  # what is lacking is one itself
        truth |= of_driving
    assert not wrong(found, **truth)
    (lack,) = (lack for lack in found.lacks if lack.kind == what)
    assert lack.size > 0 or "falls with" in str(found.reasons)
    if lack.share > 0.01:
        assert "the model does not fit" in said_of(found)


@pytest.mark.parametrize(
    ("name", "explanation"),
    [
        ("a tilted wall", "is the wall tilted"),
        ("wear", "does something wear"),
        ("a centre of mass beside", "the centre of mass beside"),
        *(
            pytest.param(*it, marks=pytest.mark.soak)
            for it in [
                ("a round wall", "is the wall round"),
                ("scrubbing wheels", "do wheels or a seal scrub"),
                ("unlike motors", "are the wheels, or their motors, unlike"),
            ]
        ),
    ],
)
def test_what_does_not_fit_is_told_with_where_it_does_not(name, explanation):
    found = identify(moved(lacking=LACKING[name], noise=1.0, wheels=True), BELIEVED)
    assert explanation in said_of(found)


def test_a_model_that_fits_is_said_to_fit_and_loses_nothing():
    failed = 0
    for seed in range(4):
        found = identify(moved(scrub=5.0, noise=1.0, wheels=True, seed=seed), BELIEVED)
        assert all(lack.ratio < 3 for lack in found.lacks)
        failed += "does not fit" in said_of(found)
    assert failed == 0


def test_a_wall_that_is_known_to_be_round_is_not_taken_for_another_mass():
    radius = -5.0
    angle = np.pi / 2 + HEIGHT / radius
    pull = TRUE.mass * 9.81 * np.sin(THETA) * (np.sin(angle) - 1)
    motion = moved(lacking=(pull, 0.0), noise=1.0, wheels=True)
    found = identify(motion, BELIEVED, site=Site(wall=Cylinder(radius)))
    assert not wrong(found)
    assert "mass" not in found.reasons
    assert "mass" in identify(motion, BELIEVED).reasons


@pytest.mark.parametrize(
    ("delay", "lag"),
    [
        pytest.param(0.015, 0.0, marks=pytest.mark.soak),
        pytest.param(0.08, 0.0, marks=pytest.mark.soak),
        pytest.param(0.0, 0.035, marks=pytest.mark.soak),
        (0.03, 0.05),
    ],
)
def test_torques_that_act_later_than_assumed_make_no_inertia_wrong(delay, lag):
    true, random = replace(TRUE, wheel_radius=0.027), np.random.default_rng(3)
    rough = since_start(np.repeat(random.normal(size=(400, 2)), 10, axis=0))  # held for 50 ms
    acting = replace(moved(), impulse=rough).acting(delay, lag).impulse
    faster, turning = acting @ [1, 1] / 0.027 / 6.5, acting @ [1, -1] * 0.3 / 0.027 / 0.25
    speed, yaw_rate = 0.5 + faster / 4, 1.0 + turning / 4
    motion = moved((speed, 0 * TIME), (since_start(yaw_rate), yaw_rate, 0 * TIME), true, noise=1.0)
    smooth = np.gradient(motion.impulse, TIME, axis=0)
    earlier = [np.interp(TIME + delay, TIME, one) for one in (motion.impulse + lag * smooth).T]
    found = identify(replace(motion, impulse=np.transpose(earlier) + rough / 4), BELIEVED)
    assert found.late == (pytest.approx(delay, abs=0.006), pytest.approx(lag, abs=0.006))
    assert "yaw_inertia" not in found.reasons
    assert not wrong(found, wheel_radius=None, half_track=None)
    assert found["yaw_inertia"] == pytest.approx(0.25, rel=0.02)
    assert "torques act" in said_of(found)


def test_a_push_of_a_second_is_left_out():
    push = 60.0 * ((TIME > 7.2) & (TIME < 7.9))
    found = identify(moved(lacking=(push, push / 10), noise=1.0, wheels=True), BELIEVED)
    assert 1 <= found.left_out <= 4
    assert not wrong(found)
    assert found["mass"] == pytest.approx(6.5, rel=0.002)
    assert f"{found.left_out} windows more that fit much worse" in said_of(found)


@pytest.mark.parametrize("effective", [1.02, 1.2])
def test_wheels_that_scrub_tell_an_effective_half_track_and_not_where_they_are(effective):
    motion = moved(scrub=30.0, effective=effective, noise=1.0, wheels=True)
    found = identify(motion, BELIEVED)
    assert "half_track" in found.reasons
    (told,) = [row for row in rows(found, BELIEVED) if row["parameter"] == "effective_half_track"]
    assert abs(told["estimate"] - 0.3 * effective) < told["half_width"] < 0.01
    changed = changes(found, BELIEVED)
    assert changed["plant_simulator"]["effective_half_track"] == pytest.approx(
        told["estimate"], rel=1e-5
    )
    assert "half_track" not in changed["plant_simulator"]
    assert f"an effective one of {0.3 * effective:.3g}"[:-1] in said_of(found) + str(found.reasons)
    assert not wrong(found, turning_friction=30.0)
    assert ("yaw_inertia" in found.reasons) == (effective > 1.1)


def test_wheels_that_slip_along_their_way_leave_mass_and_friction_as_they_are():
    """As those that scrub do: the radius that their angles show is none."""
    _, omega, _ = WINDING
    rolls = 1 + 0.1 * np.abs(omega) / np.abs(omega).max()
    believed = replace(BELIEVED, wheel_radius=TRUE.wheel_radius)
    motion = moved(scrub=30.0, effective=1.2, rolls=rolls, noise=1.0, wheels=True)
    found = identify(motion, believed)
    assert {"wheel_radius", "half_track"} <= set(found.reasons)
    assert "wheels slip: their angles show an effective one" in table(found, believed)
    assert found["mass"] == pytest.approx(6.5, rel=0.002)
    assert not wrong(found, turning_friction=30.0)
    plant = changes(found, believed)["plant_simulator"]
    assert not {"wheel_radius", "half_track"} & set(plant)
    assert plant["effective_half_track"] == pytest.approx(0.3 * 1.2, rel=0.01)


def test_odometry_that_is_made_of_the_wheels_does_not_measure_them():
    exact = moved(wheels=True)
    believed = replace(BELIEVED, wheel_radius=0.03)
    found = identify(exact, believed)
    assert {"wheel_radius", "half_track"} <= set(found.reasons)
    assert "made of them?" in said_of(found)
    assert "effective_half_track" not in table(found, believed)
    assert not {"wheel_radius", "half_track"} & set(changes(found, believed)["plant_simulator"])


def test_friction_without_a_coulomb_part_has_no_coefficient_but_is_given_to_the_controller():
    true = replace(TRUE, seal_friction_coefficient=0.0)
    found = identify(moved(true=true, viscous=200.0, noise=1.0, wheels=True), BELIEVED)
    assert "from nothing on" in found.reasons["seal_friction_coefficient"].words
    controller = changes(found, BELIEVED)["uk_torque_controller"]
    assert controller["seal_friction_coefficient"] * 0.47 * 150 == pytest.approx(
        200 * found.extent.speed, rel=0.01
    )


def test_without_a_seal_there_is_no_word_of_it():
    magnet = Site(has_seal=False)
    true = replace(TRUE, seal_friction_coefficient=0.1)
    motion = moved(true=true, noise=1.0, wheels=True)
    motion = replace(motion, pressure=0 * TIME)
    found = identify(motion, BELIEVED, site=magnet)
    said = said_of(found) + table(found, BELIEVED) + str(changes(found, BELIEVED))
    assert not [word for word in ("seal", "pressure", "suction") if word in said]
    (row,) = (row for row in rows(found, BELIEVED) if row["parameter"] == "rolling_friction")
    assert row["estimate"] == pytest.approx(0.1 * 0.47 * 150, rel=0.01)
    assert row["unit"] == "N"


def test_rates_may_have_a_bias():
    motion = moved(noise=1.0, wheels=True)
    found = identify(replace(motion, rates=motion.rates + np.array([0.02, 0.05])), BELIEVED)
    assert not wrong(found)
    assert "does not fit" not in said_of(found)


def test_torques_that_are_not_those_commanded_scale_nothing_silently():
    found = identify(replace(moved(wheels=True, noise=1.0), torque_ratio=0.5), BELIEVED)
    assert "torques in joint_states are 0.5 times those commanded" in said_of(found)
    assert set(changes(found, BELIEVED)["plant_simulator"]) == {"wheel_radius", "half_track"}


@pytest.mark.parametrize(
    "step", [4, 20, *(pytest.param(it, marks=pytest.mark.soak) for it in (1, 10))]
)
def test_odometry_may_be_slow(step):
    motion = moved(noise=1.0, wheels=True, scrub=5.0)
    arrays = {
        name: getattr(motion, name)[::step]
        for name in ("time", "pose", "rates", "impulse", "pressure", "stretch", "wheel_angles")
    }
    found = identify(replace(motion, **arrays), BELIEVED)
    assert found["yaw_inertia"] == pytest.approx(0.25, rel=0.1)
    assert found["turning_friction"] == pytest.approx(5.0, rel=0.01)


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("scrub", [0.0, 30.0])
@pytest.mark.parametrize("viscous", [0.0, 20.0])
def test_intervals_hold_the_truth_of_95_in_100(scrub, viscous):
    truth = {"turning_friction": scrub, "viscous_friction": viscous}
    missed = np.zeros(len(TRUTH))
    for seed in range(100):
        motion = moved(noise=1.0, seed=seed, scrub=scrub, viscous=viscous, wheels=True)
        outside = wrong(identify(motion, BELIEVED), widths=1.0, **truth)
        missed += [name in outside for name in TRUTH]
    assert (missed <= 10).all(), dict(zip(TRUTH, missed, strict=True))


SHORT = replace(SCENARIOS["paper.yaml"], duration=6.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.soak) for seed in (1, 2))]
)
def test_a_noisy_closed_loop_tells_what_is_30_percent_off(seed):
    off, _ = errors(*identified(SHORT, seed))
    assert np.abs(off).max() < 0.02


@pytest.mark.soak
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
    runs = [identified(SCENARIOS[name], seed) for seed in range(100)]
    off, inside = (np.array(part) for part in zip(*(errors(*run) for run in runs), strict=True))
    assert np.nanmax(np.abs(off)) < 0.02
    assert (inside.sum(axis=0) >= 90).all()
    assert np.isfinite(off).mean() >= 0.9  # nor is it right by telling nothing
    assert sum(scrub_error(SCENARIOS[name], *run)[1] for run in runs) >= 90
