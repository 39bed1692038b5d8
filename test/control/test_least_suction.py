"""The least pressure: against margins by another way, and over a path driven with it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.build import build_controller, settings
from climber_uk.control.least_suction import (
    NOT_MEASURED,
    STEPS,
    TOO_WEAK,
    LeastSuction,
    SuctionOptions,
)
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import Attachment, Grip, Magnetic, Suction
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.demand import demanded
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.mechanics.waypoints import Rounding
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.planning.given_path import Manner, planned
from climber_uk.ros import plant_parts
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import SimulatedRobot

CONFIG = Path(__file__).parents[2] / "config" / "climber.yaml"
OURS, PLANTS, PLAN = (
    Values(read_file(CONFIG, f"/{node}"))
    for node in ("uk_torque_controller", "plant_simulator", "trajectory_publisher")
)
CLIMBER, GRIP = OURS.read(Climber), OURS.read(Grip)
FULL, STOPS_AT = 8000.0, 5000.0

climbers = st.builds(
    lambda mass, share, friction, inclination, pressure: replace(
        CLIMBER,
        mass=mass,
        wheel_load_share=share,
        seal_friction_coefficient=friction,
        inclination=inclination,
        suction_pressure=pressure,
    ),
    *(st.floats(1.0, 12.0), st.floats(0.2, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 180.0)),
    st.floats(3000.0, 20000.0),
)
headings, speeds = st.floats(-np.pi, np.pi), st.floats(-0.5, 0.5)
motions = st.tuples(headings, speeds, st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3))
margins = st.tuples(st.floats(1.0, 4.0), st.floats(1.0, 4.0))


def reference(heading, speed, yaw_rate, acceleration, yaw_acceleration):
    along, across = np.array([np.cos(heading), np.sin(heading)]), speed * yaw_rate
    aside = across * np.array([-np.sin(heading), np.cos(heading)])
    return Reference(
        np.array([[0.0, 0.0, heading]]),
        np.array([[*(speed * along), yaw_rate]]),
        np.array([[*(acceleration * along + aside), yaw_acceleration]]),
        np.zeros((1, 2)),
    )


def margins_at(climber, attachment, motion, pressure):
    """Slip and tip margin of a climber that has been at that pressure all along."""
    there = replace(climber, suction_pressure=pressure)
    demand = demanded(there, there.seal_friction, reference(*motion))
    forces = tuple(torque / there.wheel_radius for torque in demand.torques)
    into, along = there.gravity_into_wall, there.weight_along_wall / there.mass
    slip = attachment.slip_margin(there, into, forces, demand.lateral, demand.across)
    return float(np.squeeze(slip)), float(attachment.tip_margin(there, into, along))


def least(climber, motion, asked, lowest=1000.0, measured=None):
    """Least pressure by `LeastSuction`, of a climber whose pressure is `measured` now."""
    options = SuctionOptions(slip_margin=asked[0], tip_margin=asked[1])
    found = LeastSuction(options, climber, Attachment(grip=GRIP))
    here = replace(climber, suction_pressure=measured or climber.suction_pressure)
    demand = demanded(here, here.seal_friction, reference(*motion))
    return float(found.least(here, demand, lowest)[0])


@given(climbers, motions, margins, st.floats(0.0, 2500.0), st.floats(0.5, 1.5))
def test_from_the_least_pressure_on_every_one_keeps_the_margins_and_one_step_lower_not(
    climber, motion, asked, lowest, measured
):
    full, attachment = climber.suction_pressure, Attachment(grip=GRIP)
    found = least(climber, motion, asked, lowest, measured * full)
    assert lowest <= found <= full
    tried = np.linspace(lowest, full, STEPS)
    kept = np.array(
        [
            np.subtract(margins_at(climber, attachment, motion, pressure), asked).min()
            for pressure in tried
        ]
    )
    number = int(np.abs(tried - found).argmin())
    assert tried[number] == pytest.approx(found)
    assert (kept[number:-1] > -1e-6).all()  # the full one counts as kept: there is no more
    assert number == 0 or kept[number - 1] < 1e-6


@given(climbers, motions, margins, margins)
def test_more_margin_asks_for_no_less_pressure(climber, motion, one, other):
    more = tuple(np.maximum(one, other))
    assert least(climber, motion, more) >= max(
        least(climber, motion, one), least(climber, motion, other)
    )


@given(st.floats(0.02, 3.0), st.floats(0.0, 2.0), st.floats(100.0, 1e5), st.floats(0.0, 5.0))
def test_what_may_be_needed_beyond_the_preview_is_reached_by_then(horizon, lag, rate, leak):
    suction = Suction(pump_time=lag, leak_time=leak if lag > 0 else 0.0)
    found = LeastSuction(
        SuctionOptions(rise_rate=rate), CLIMBER, Attachment(adhesion=suction, grip=GRIP)
    )
    pressure = begin = found.in_reach(horizon)
    steps = 400
    for time in np.arange(steps) * horizon / steps:  # each a little early: a ramp of stairs
        pump = min(begin + rate * time, found.full) / found.comes_to
        pressure = suction.pressure(pressure, pump, horizon / steps)
    assert pressure >= found.full - found.reserve - rate * horizon / steps - 1e-6


@pytest.mark.parametrize(("lag", "least"), [(0.0, 8000 - 7200), (0.3, 5961.0), (0.5, 7133.0)])
def test_a_slower_pump_is_lowered_less(lag, least):
    """8 kPa - 8 kPa/s T ln(1 + 160 Pa / (8 kPa/s T) exp(0.9 s / T)), or all of 0.9 s of a rise."""
    suction = Suction(pump_time=lag)
    found = LeastSuction(SuctionOptions(), CLIMBER, Attachment(adhesion=suction, grip=GRIP))
    assert found.in_reach(0.9) == pytest.approx(least, abs=1.0)


def test_only_a_pump_can_be_asked_for_less():
    with pytest.raises(ValueError, match="needs adhesion=suction"):
        LeastSuction(SuctionOptions(enabled=True), CLIMBER, Attachment(adhesion=Magnetic()))


ROUND = build_trajectory(  # up at first, then down, and up again, in 10.5 s
    Values(
        {**PLAN.by_name, "shape": "circle", "circle.radius": 0.25, "rest_to_rest.rate": 0.8}
    ).read
)


class Drive:
    """A climber on its path, its pump set as it is asked for; climber.yaml's, around a circle.

    `true` and `told` are parameters of the climber that differ from those of that file, and what
    the controller has in their place.
    """

    def __init__(self, trajectory=ROUND, true=None, told=None, lag=0.2, **options):
        true, pump = true or {}, {"suction.pump_time": lag}
        self.ours = Values({**OURS.by_name, **pump, **true, **(told or {})})
        plants = Values({**PLANTS.by_name, **pump, **true})
        self.options, self.duration = plants.read(SimulationOptions), trajectory.duration
        start, self.period = (
            State.rolling(trajectory.at(0.0).pose, 0.0, 0.0),
            self.options.control_period,
        )
        self.robot = SimulatedRobot(plant_parts.parts(plants), start, self.period)
        self.controller = build_controller(self.ours, self.robot.pressure)
        attachment = Attachment(adhesion=self.ours.read(Suction, "suction."), grip=GRIP)
        climber = self.ours.read(Climber)
        self.least = LeastSuction(SuctionOptions(**options), climber, attachment)
        self.path = sampled(trajectory, self.duration + 2.0)
        self.tick, self.rows, self.troubles = 0, [], set()
        self.measures = self.tells = self.obeys = True
        self.otherwise = 5000.0  # [Pa] to which a pump is set that does not obey

    def until(self, end):
        """Rows (n, 5) of pressure, setpoint [Pa], slip margin, distance off [m], speed [m/s]."""
        begin = len(self.rows)
        while self.tick * self.period < end:
            self.step()
        return np.array(self.rows[begin:])

    def step(self):
        robot, controller = self.robot, self.controller
        stamp = SECOND + round(self.tick * self.period * SECOND)
        if self.tells and self.tick % 20 == 0:
            known = np.abs(self.path.times - stamp - SECOND // 2) <= SECOND // 2
            parts = self.path.times, self.path.pose, self.path.velocity, self.path.acceleration
            controller.on_reference(stamp, Preview(*(part[known] for part in parts)))
        answer = controller.on_odometry(stamp, stamp, robot.odometer.latest()[1].motion)
        if self.tick % 10 == 0:
            controller.retune(settings(self.ours, robot.pressure))
            measured = robot.pressure if self.measures else None
            pressure, trouble = self.least.setpoint(controller, answer, measured)
            self.troubles.add(trouble)
            self.rows.append(self.row(controller.active.at(stamp), pressure))
            robot.setpoint = pressure if self.obeys else self.otherwise
        for _ in range(self.options.steps):
            robot.advance(np.zeros(2) if answer is None else answer.torques)
        robot.measure()
        self.tick += 1

    def row(self, target, pressure):
        here: Motion = self.robot.state.motion
        off = np.hypot(here.x - target.x, here.y - target.y) if target else 0.0
        return self.robot.pressure, pressure, self.robot.margins()[0], off, here.speed


def test_while_it_moves_less_pressure_keeps_the_margins_and_the_path():
    """Margins are 2.84 at the full pressure; 2.8 of them suffice."""
    drive = Drive(slip_margin=2.8)
    pressure, setpoint, slip, off, speed = drive.until(drive.duration + 0.5).T
    assert pressure[0] == setpoint[0] == FULL
    assert (setpoint[np.abs(speed) < 0.01] == FULL).all()
    assert pressure.min() < 0.7 * FULL
    assert slip.min() >= 2.8
    assert np.diff(setpoint).min() >= -0.05 * 500.0 - 1e-6  # [Pa] in 0.05 s
    assert np.diff(setpoint).max() <= 0.05 * 8000.0 + 1e-6
    assert off.max() < 0.3e-3
    assert drive.troubles == {""}


def test_it_never_asks_for_less_than_what_stops_the_climber():
    drive = Drive(slip_margin=1.0, tip_margin=1.0, fall_rate=5000.0)
    pressure, setpoint, *_ = drive.until(4.0).T
    assert pressure.min() >= STOPS_AT
    assert setpoint.min() == pytest.approx(STOPS_AT + 0.02 * FULL)


@pytest.mark.parametrize(
    ("what", "trouble"), [("measures", NOT_MEASURED), ("obeys", TOO_WEAK), ("tells", "")]
)
def test_without_gauge_pump_or_reference_it_is_the_full_pressure(what, trouble):
    drive = Drive(slip_margin=2.8)
    assert drive.until(2.2)[-1, 1] < 0.97 * FULL
    setattr(drive, what, False)
    assert drive.until(3.4)[:, 1].max() == FULL
    assert drive.troubles == {"", trouble}


def test_in_the_safe_output_it_is_the_full_pressure_at_once():
    drive = Drive()
    assert drive.until(3.0)[-1, 1] < 0.9 * FULL
    drive.controller.enable(False)
    assert drive.until(3.1)[-1, 1] == FULL


def random_case(random):
    """A path, the climber, what its controller is told of it, and the pump's lag."""
    corners = np.cumsum(random.normal(0, 0.5, (5, 2)), axis=0)
    manner = Manner(Rounding(), RestToRest(rate=0.15, ramp_time=1.0))
    trajectory, _ = planned(corners, manner)
    uniform = random.uniform
    true = {
        "mass": uniform(3, 7),
        "wheel_load_share": uniform(0.6, 0.95),
        "seal_friction_coefficient": uniform(0.2, 0.7),
        "suction_pressure": uniform(8000, 14000),
        "inclination": random.choice([60.0, 90.0, 120.0]),
    }
    told = {"mass": true["mass"] * uniform(0.9, 1.1), "least_pressure": random.choice([0.0, 3e3])}
    told["seal_friction_coefficient"] = true["seal_friction_coefficient"] * uniform(0.7, 1.3)
    return trajectory, true, told, uniform(0.0, 0.4)


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(20))
def test_random_climbers_that_are_told_wrong_keep_the_margins_that_they_can_have(seed):
    """Mass within 10 %, friction within 30 %, which the observer learns."""
    random = np.random.default_rng(seed)
    case, asked = random_case(random), random.uniform(1.3, 3.0)
    options = {"slip_margin": asked, "tip_margin": asked, "fall_rate": 3000.0}
    drives = [Drive(*case, **options) for _ in range(2)]
    drives[0].obeys, drives[0].otherwise = False, None
    full, saved = (drive.until(min(drive.duration, 20.0)) for drive in drives)
    assert saved[:, 2].min() > 0.97 * min(asked, full[:, 2].min())
    assert saved[:, 3].max() < full[:, 3].max() + 1e-3
    assert drives[1].controller.mode.value == "following"
