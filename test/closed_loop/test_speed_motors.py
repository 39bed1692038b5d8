"""A motor board that takes speeds in the place of motors that take torques.

`pytest -rP` tells how near they come, and how much commands change.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import Link, Run, simulate
from climber_uk.control.build import build_controller
from climber_uk.control.safety import Mode
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.sensors import Sensors

CONFIG = Path(__file__).parents[2] / "config" / "velocity.yaml"
SMALL = {  # a fifth of the lap in a fifth of its time
    "lemniscate.half_width": 0.3,
    "lemniscate.half_height": 0.15,
    "rest_to_rest.rate": 0.6,
    "rest_to_rest.ramp_time": 1.0,
}
FORTH_AND_BACK = {
    "shape": "line",
    "line.length": 0.4,
    "rest_to_rest.rate": 0.3,
    "rest_to_rest.ramp_time": 1.0,
    "rest_to_rest.runs": 2,
}
SERVO = Values(read_file(CONFIG, "/plant_simulator")).read(Motors)
DEAD_BAND = replace(SERVO, velocity_dead_band=0.02)
INNER = Link(step=0.001)  # [s] of the servo, too
ENCODERS = Sensors(odometry_source="wheels", encoder_resolution=2 * np.pi / 4096)


def loop(path, **parameters):
    """A trajectory, where it begins, and a controller that will follow it."""
    given = {**read_file(CONFIG, "/trajectory_publisher"), **path}
    trajectory = build_trajectory(Values(given).read)
    reference = trajectory.at(0.0)
    ours = {**read_file(CONFIG, "/uk_torque_controller"), **parameters}
    controller = build_controller(Values(ours), None)
    return trajectory, State(reference.pose, reference.velocity), controller


def drive(servo, path=SMALL, link=INNER, truth=lambda it: it, **parameters):
    """Run whose last 2 s are rest; and the rims' speeds (n, 2) told [m/s]."""
    trajectory, start, controller = loop(path, **parameters)
    believed: Climber = controller.law.climber
    told, answers = [], controller.on_odometry

    def on_odometry(*odometry):
        answer = answers(*odometry)
        assert controller.mode is Mode.FOLLOWING, controller.detail
        told.append(believed.rim_rates(answer.speeds))
        return answer

    controller.on_odometry = on_odometry
    link = replace(link, servo=servo)
    run: Run = simulate(
        trajectory, start, trajectory.duration + 2.0, controller, truth(believed), link
    )
    told = believed.wheel_radius * np.array(told)
    changes = ", ".join(f"{1e3 * change:.2f}" for change in hunting(told))
    print(f"RMS {1e3 * run.rms():.3f} mm, maximum {1e3 * run.distance.max():.2f} mm")
    print(f"RMS change of a command {changes} mm/s, on the whole and at rest")
    return run, told


def hunting(told):
    """RMS of the change from one command to the next [m/s], on the whole and at rest."""
    changes = np.diff(told, axis=0)
    return [np.sqrt(np.mean(part**2)) for part in (changes, changes[-len(changes) // 20 :])]


def test_climber_yaml_differs_in_its_motors_only():
    for node, ours in {
        "uk_torque_controller": {"motors", "servo_time_constant"},
        "plant_simulator": {field for field in vars(SERVO) if not field.startswith("torque")}
        | {"integration_step"},
    }.items():
        other, this = (
            read_file(CONFIG.parent / f"{name}.yaml", f"/{node}")
            for name in ("climber", "velocity")
        )
        changed = {name for name in this if this[name] != other.get(name)}
        assert changed == ours
        assert other.keys() <= this.keys()


@pytest.mark.parametrize(
    "path",
    [pytest.param(SMALL, marks=pytest.mark.soak), FORTH_AND_BACK],
    ids=["eight", "forth and back"],
)
def test_a_servo_in_steps_of_a_millimetre_a_second_follows(path):
    run, told = drive(SERVO, path)
    assert run.rms() < 1e-3
    on_the_way, at_rest = hunting(told)
    assert on_the_way < 3e-3
    assert at_rest < 1e-6


@pytest.mark.parametrize(
    "path",
    [SMALL, pytest.param(FORTH_AND_BACK, marks=pytest.mark.soak)],
    ids=["eight", "forth and back"],
)
def test_a_dead_band_costs_millimetres_and_makes_no_servo_hunt(path):
    run, told = drive(DEAD_BAND, path)
    assert run.rms() < 3e-3
    on_the_way, at_rest = hunting(told)
    assert on_the_way < 4e-3
    assert at_rest < 1e-6


@pytest.mark.parametrize(
    ("servo", "link"),
    [
        pytest.param(replace(SERVO, servo_time_constant=0.0), INNER, marks=pytest.mark.soak),
        pytest.param(replace(SERVO, servo_time_constant=0.01), INNER, marks=pytest.mark.soak),
        pytest.param(replace(SERVO, servo_time_constant=0.04), INNER, marks=pytest.mark.soak),
        pytest.param(SERVO, replace(INNER, delay=0.02), marks=pytest.mark.soak),
        pytest.param(SERVO, replace(INNER, period=0.02), marks=pytest.mark.soak),
        pytest.param(
            DEAD_BAND, replace(INNER, delay=0.005, sensors=ENCODERS), marks=pytest.mark.soak
        ),
    ],
    ids=["at once", "10 ms", "40 ms", "20 ms of delay", "50 Hz", "encoders"],
)
def test_a_servo_that_is_other_than_told_is_learnt(servo, link):
    run, _ = drive(servo, link=link)
    assert run.rms() < 3e-3


@pytest.mark.parametrize(
    "change",
    [{"mass": 7.0}, pytest.param({"seal_friction_coefficient": 0.1}, marks=pytest.mark.soak)],
    ids=str,
)
def test_what_it_carries_and_rubs_against_is_the_servos_business(change):
    run, _ = drive(SERVO, FORTH_AND_BACK, truth=lambda climber: replace(climber, **change))
    assert run.rms() < 1e-3


@pytest.mark.parametrize(
    "spoilt",
    [
        lambda rates: rates * [1.0, 0.0],
        pytest.param(lambda rates: rates * [0.0, 1.0], marks=pytest.mark.soak),
        lambda rates: 0 * rates,
        lambda rates: rates * [1.0, 0.0] + [0.0, 11.0],
    ],
    ids=["left", "right", "both", "left at a speed of its own"],
)
def test_the_guard_finds_a_wheel_that_does_not_obey(spoilt):
    trajectory, start, controller = loop({})
    believed, found = controller.law.climber, []

    def motors(state, rates):
        found.append(controller.mode)
        return spoilt(rates) if len(found) > 6.0 / link.step else rates

    link = Link(servo=SERVO)
    run = simulate(trajectory, start, 7.0, controller, believed, link, motors)
    before, after = found[: round(6.0 / link.step)], found[round(6.5 / link.step) :]
    assert set(before) == {Mode.FOLLOWING}
    assert set(after) <= {Mode.DEAD_WHEEL, Mode.STALLED}
    assert np.hypot(*run.velocity[:, :2].T).max() < 0.4
