"""What a trial finds out of a simulated driver is what was put into it."""

from dataclasses import replace

import numpy as np
import pytest
from driven import CLIMBER, START, arrived, evidence, odometry, tried

from climber_uk.driver_check import checks, reacting, report
from climber_uk.driver_check.evidence import (
    ExpectedDriver,
    PulseTimes,
    TrialRecord,
    WheelCommand,
)
from climber_uk.driver_check.report import Verdict
from climber_uk.driver_check.response import WIRINGS, expected_gain, response_of
from climber_uk.driver_check.trial import Bounds
from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.contact import Contact, FourWheeled
from climber_uk.mechanics.friction import FRICTION
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.sensors import Sensors

RIGHT = np.eye(2)


def test_expected_gains_are_those_of_the_papers_equations():
    # 2 / (r m) and 2 d / (r J)
    wanted = [2 / (0.027 * 5.0), 2 * 0.3 / (0.027 * 0.33)]
    assert expected_gain(CLIMBER) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    "wiring",
    [pytest.param(w, marks=[pytest.mark.soak] if n % 3 else []) for n, w in enumerate(WIRINGS)],
)
def test_every_wiring_is_found_by_name(wiring):
    seen = tried(WIRINGS[wiring])
    found, likeness = response_of(seen).wiring
    assert found == wiring
    assert likeness > 0.95


@pytest.mark.parametrize(
    "gain", [0.5, *(pytest.param(g, marks=pytest.mark.soak) for g in (1.0, 2.0))]
)
def test_gains_are_those_of_the_driver_whatever_friction_and_weight_do(gain):
    gains = response_of(tried(gain * RIGHT)).gains
    assert np.diag(gains) == pytest.approx([gain, gain], rel=0.02)


@pytest.mark.parametrize(
    "law", [pytest.param("viscous", marks=pytest.mark.soak), "stribeck", "lugre"]
)
def test_gains_are_found_under_other_friction(law):
    climber = CLIMBER
    if law == "viscous":  # holds nothing on a wall
        climber = replace(climber, inclination=0.0)
    gains = response_of(tried(RIGHT, climber, FRICTION[law]())).gains
    assert np.diag(gains) == pytest.approx([1.0, 1.0], rel=0.05)


IMPERFECT = pytest.mark.parametrize(
    "sensors",
    [
        Sensors(odometry_source="wheels", encoder_resolution=0.006),
        Sensors(
            position_noise=5e-4, heading_noise=1e-3, speed_noise=5e-3, yaw_rate_noise=1e-2, seed=1
        ),
    ],
    ids=["encoders", "noise"],
)


@IMPERFECT
def test_gains_are_found_with_imperfect_sensors(sensors):
    seen = tried(RIGHT, sensors=sensors)
    assert np.diag(response_of(seen).gains) == pytest.approx([1.0, 1.0], rel=0.1)
    assert not report.has_failed(checks.report(seen))


def test_the_delay_of_torques_is_found():
    assert response_of(tried(RIGHT, late=5)).delay == pytest.approx(0.025, abs=0.001)


def test_a_trial_stays_within_its_torque_and_ends_at_rest_where_it_began():
    seen = tried(RIGHT)
    assert seen.trial.trouble == ""
    assert max(np.abs(c.torques).max() for c in seen.trial.commands) <= 0.5 * 4.0
    motion = seen.motion
    assert np.abs(motion.twist[-1]) == pytest.approx(0.0, abs=0.03)
    assert np.ptp(motion.pose[:, :2], axis=0).max() < 0.02
    assert np.ptp(motion.pose[:, 2]) < 0.25
    assert list(seen.trial.commands[-1].torques) == [0.0, 0.0]


@pytest.mark.parametrize(
    "begin",
    [
        pytest.param(begin, marks=() if begin in (128, 332) else pytest.mark.soak)
        for begin in range(60, 400, 68)
    ],
)
def test_a_pulse_in_which_a_busy_machine_missed_something_is_tried_again(begin):
    seen = tried(RIGHT, stall=range(begin, begin + 20))
    assert seen.trial.trouble == ""
    assert np.diag(response_of(seen).gains) == pytest.approx([1.0, 1.0], rel=0.02)
    assert reacting.watchdog(seen).verdict is Verdict.PASS
    assert np.ptp(seen.motion.pose[:, 2]) < 0.6


def test_a_trial_ends_at_its_bounds():
    seen = tried(RIGHT, bounds=Bounds(max_turn=0.05))
    assert "more than max_turn" in seen.trial.trouble
    assert np.abs(seen.motion.twist[-1]) == pytest.approx(0.0, abs=0.03)
    seen = tried(RIGHT, bounds=Bounds(max_travel=0.004))
    assert "more than max_travel" in seen.trial.trouble
    assert np.abs(seen.motion.twist[-1]) == pytest.approx(0.0, abs=0.03)


def test_a_trial_of_a_climber_that_moves_does_not_begin():
    start = State.rolling(START.pose, 0.0, 0.3)
    seen = tried(RIGHT, start=start)
    assert "it moves already" in seen.trial.trouble
    assert not any(c.torques.any() for c in seen.trial.commands)


def test_without_enough_torque_it_says_so():
    seen = tried(RIGHT, bounds=Bounds(torque_share=0.05))
    found = reacting.wheels(seen)
    assert found.verdict is Verdict.WARN
    assert "did not drive" in found.said
    assert "torque_share" in found.hint


SPEEDS = Motors(motors="velocity", servo_time_constant=0.05)
TOLD = ExpectedDriver(motors="velocity", servo_time_constant=0.05)


def by_speeds(wheels=RIGHT, expected=TOLD, **how):
    """Trial of a board that takes speeds."""
    return tried(wheels, **{"motors": SPEEDS, "expected": expected, **how})


@pytest.mark.parametrize(
    "wiring",
    [pytest.param(w, marks=[pytest.mark.soak] if n % 3 else []) for n, w in enumerate(WIRINGS)],
)
def test_every_wiring_of_a_board_that_takes_speeds_is_found_by_name(wiring):
    seen = by_speeds(WIRINGS[wiring])
    found, likeness = response_of(seen).wiring
    assert seen.trial.takes_speeds
    assert found == wiring
    assert likeness > 0.95


@pytest.mark.parametrize(
    ("board", "told"),
    [
        ("torque", "velocity"),
        ("velocity", "torque"),
        *(pytest.param(both, both, marks=pytest.mark.soak) for both in ("torque", "velocity")),
    ],
)
def test_the_board_is_told_and_whether_the_controller_knows(board, told):
    seen = tried(
        RIGHT,
        motors=replace(SPEEDS, motors=board),
        expected=ExpectedDriver(motors=told, servo_time_constant=0.05),
    )
    found = checks.report(seen)
    failed = [name for name, finding in found.items() if finding.verdict is Verdict.FAIL]
    assert failed == ([] if board == told else ["motors"])
    assert {"torque": "effort", "velocity": "velocity"}[board] in found["motors"].said


@pytest.mark.parametrize(
    ("time_constant", "late"),
    [
        *((0.02, 0), (0.1, 4)),
        *(pytest.param(T, late, marks=pytest.mark.soak) for T in (0.01, 0.05) for late in (0, 4)),
    ],
)
def test_time_constant_and_delay_of_a_servo_are_told_apart(time_constant, late):
    motors = Motors(motors="velocity", servo_time_constant=time_constant, velocity_resolution=1e-3)
    seen = by_speeds(motors=motors, late=late)
    response = response_of(seen)
    assert response.time_constant == pytest.approx(time_constant, rel=0.1, abs=2e-3)
    assert response.delay == pytest.approx(0.005 * late, abs=4e-3)
    servo = reacting.servo(seen)
    is_off = not 0.5 <= time_constant / 0.05 <= 2.0
    assert servo.verdict is (Verdict.WARN if is_off else Verdict.PASS)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_board_whose_speeds_are_others_is_told(factor):
    found = checks.report(by_speeds(factor * RIGHT))
    assert found["gain"].verdict is Verdict.FAIL
    assert found["gain"].values["drive"] == pytest.approx(factor, rel=0.02)


@IMPERFECT
def test_a_board_that_takes_speeds_passes_with_imperfect_sensors(sensors):
    found = checks.report(by_speeds(sensors=sensors))
    assert not report.has_failed(found)
    assert found["servo"].values["time_constant"] == pytest.approx(0.05, rel=0.2)


def test_a_board_that_obeys_neither_is_told():
    found = checks.report(by_speeds(0 * RIGHT))
    assert found["wheels"].verdict is Verdict.FAIL
    assert "no reaction to speeds, nor to torques" in found["wheels"].said


FOUR = Contact(locomotion=FourWheeled(), grip=Grip(wheel_inertia=2e-4))


@pytest.mark.slow
@pytest.mark.soak
@pytest.mark.parametrize("board", ["velocity", "torque"])
def test_four_wheels_on_a_wall_pass_and_what_they_scrub_is_told(board):
    motors = replace(SPEEDS, motors=board)
    expected = replace(TOLD, motors=board)
    start = State(np.array([0.0, 3.0, 0.785]), np.zeros(3))
    found = checks.report(
        tried(RIGHT, motors=motors, expected=expected, contact=FOUR, slip=True, start=start)
    )
    assert not report.has_failed(found), report.as_text(found)
    told = found["turning"].values
    assert told["effective_half_track"] == pytest.approx(0.35, abs=0.015)
    if board == "torque":  # μ N l / 2 with N = 384 N, less what the wheels' drive takes of it
        assert 0.85 * 38.4 < told["turning_friction"] < 38.4


def silence(acceleration, until):
    """Evidence of a turn that goes on accelerating for some time [s] after the last command."""
    time = np.arange(0.0, 1.0, 0.005)
    rate = 0.075 + acceleration * np.clip(time - 0.15, 0.0, until)
    heading = np.cumsum(rate) * 0.005
    stamps = (1e9 + time * 1e9).astype(np.int64).tolist()
    heard = [
        arrived(odometry((0.0, 0.0, h), (0.0, 0.0, r), s))
        for h, r, s in zip(heading, rate, stamps, strict=True)
    ]
    commands = [WheelCommand(stamps[0], np.array([0.01, -0.01]))]
    pulses = [PulseTimes(True, stamps[0], stamps[30])]
    return evidence(heard, TrialRecord(pulses, commands, 2.0, (stamps[31], stamps[-1])))


def test_a_torque_that_ends_after_the_last_command_passes():
    assert reacting.watchdog(silence(0.5, until=0.1)).verdict is Verdict.PASS


def test_a_torque_that_does_not_end_fails():
    found = reacting.watchdog(silence(0.5, until=9.0))
    assert found.verdict is Verdict.FAIL
    assert found.values["acceleration"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.parametrize(
    ("how", "hint"),
    [
        ({"bounds": Bounds(max_turn=0.05)}, "look what has moved it"),
        ({"start": State.rolling(START.pose, 0.0, 0.3)}, "hold it"),
    ],
    ids=["too far", "moves already"],
)
def test_the_hint_is_for_what_has_stopped_the_trial(how, hint):
    seen = tried(RIGHT, **how)
    found = reacting.trial(seen)
    assert (found.verdict, found.said) == (Verdict.FAIL, f"stopped: {seen.trial.trouble}")
    assert hint in found.hint
