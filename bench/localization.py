"""`python bench/localization.py`: where the climber believes to be, and where it is, row by row.

Lock-step at 200 Hz, in one process: the simulated robot with encoders, an IMU and fixes, the filter
of `wall_odometry`, and the controller, which is told nothing else. The figure of eight of
config/climber.yaml, 57 s; the sensors are those of config/field.yaml unless a row says otherwise.
"""

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from identification_experiments import SCENARIOS

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.timing import Timing
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Located, Localizer
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.simulation.field_sensors import EncoderErrors, FieldSensors, FixErrors, ImuErrors
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

RUN = SCENARIOS["climber.yaml"]
PERIOD, STEP = 0.005, 0.0025  # [s]
MILLIMETRE = 1e-3
# 0.1°/√s and 0.5°/s; 0.05 m/s² at 200 Hz
IMU = ImuErrors(
    enabled=True,
    gyro_noise=math.radians(0.1),
    gyro_bias=math.radians(0.5),
    acceleration_noise=0.05 * math.sqrt(PERIOD),
)
ENCODERS = EncoderErrors(resolution=2 * math.pi / 4096, slip=0.01)
FIXES = FixErrors(period=0.1, delay=0.1, position_noise=0.025)
FILTER = LocalizationOptions(initial_y=3.0, initial_heading=math.pi / 4)


@dataclass(frozen=True)
class Case:
    """Sensors, creep, and what the filter believes; what one row of the table tries."""

    imu: ImuErrors = IMU
    encoders: EncoderErrors = ENCODERS
    fixes: FixErrors = FIXES
    options: LocalizationOptions = FILTER
    creep: float = 0.03
    inclination: float = 90.0
    gap: tuple[float, float] = (0.0, 0.0)  # [s] without fixes
    moved: tuple[float, float] = (math.inf, 0.0)  # [s] from which fixes are so much off [m]
    duration: float = 57.0  # [s]
    turned: float = 0.0  # [rad] of the true heading at the start, away from the reference's
    believes_truth: bool = False  # whether the controller gets perfect odometry


@dataclass
class Record:
    """What a run leaves: one row for each odometry."""

    rows: list[list[float]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    filter_time: float = 0.0  # [s] of the wall clock

    def add(self, now: float, robot: SimulatedRobot, located: Located, estimate: Array) -> None:
        """Add where the climber is and where it believes to be."""
        motion, covariance = located.motion, located.pose_covariance
        off = np.array([motion.x, motion.y, motion.heading]) - robot.state.pose
        off[2] = wrapped(float(off[2]))
        inner = estimate[:3] - robot.state.pose
        inner[2] = wrapped(float(inner[2]))
        self.rows.append([now, *robot.state.pose, *off, *inner, *covariance.ravel()])


class Loop:
    """One closed loop of a case."""

    def __init__(self, case: Case, seed: int) -> None:
        self.case = case
        believed = replace(RUN.believed, inclination=case.inclination)
        law = ControlLaw(believed, RUN.guidance)
        self.controller = Controller(Settings(law, timing=Timing(control_period=PERIOD)))
        pose = RUN.start.pose + np.array([0.0, 0.0, case.turned])
        start = State(pose, np.zeros(3))
        physics = Physics(creep=case.creep)
        parts = Parts(Plant(believed, STEP), Motors(), Sensors(), physics)
        self.robot = SimulatedRobot(parts, start, PERIOD)
        seeded = [
            replace(errors, seed=3 * seed + number)
            for number, errors in enumerate((case.imu, case.encoders, case.fixes))
        ]
        self.sensors = FieldSensors(*seeded, PERIOD, start)
        options = replace(case.options, inclination=case.inclination)
        self.localizer = Localizer(options)
        self.torques: Array = np.zeros(2)
        self.record, self.sent = Record(), []

    def run(self) -> "Loop":
        """Go through it."""
        self.controller.on_reference(0, sampled(RUN.trajectory, self.case.duration))
        for number in range(round(self.case.duration / PERIOD) + 1):
            now = number * PERIOD
            stamp = SECOND + round(now * SECOND)
            if number > 0:
                self.robot.measure()
            located = self.locate(stamp, now)
            if located is not None:
                self.record.add(now, self.robot, located, self.localizer.estimate.mean)
                motion = self.robot.state.motion if self.case.believes_truth else located.motion
                answer = self.controller.on_odometry(stamp, stamp, motion)
                if answer is not None:
                    self.torques = answer.torques
            self.sent.append(self.torques)
            for _ in range(round(PERIOD / STEP)):
                self.robot.advance(self.torques)
        return self

    def locate(self, stamp: int, now: float) -> Located | None:
        """Have the sensors measure, and the filter take it."""
        case, sensors, state = self.case, self.sensors, self.robot.state
        sample = sensors.imu.measure(state, self.robot.plant)
        right, left = sensors.encoders.measure(self.robot.angles).tolist()
        fixes = sensors.fixes.measure(stamp, state)
        began = time.perf_counter()
        for fix in fixes:
            measured_at = fix.stamp / SECOND - 1
            if not case.gap[0] <= measured_at < case.gap[1]:
                off = np.array([case.moved[1] * (measured_at >= case.moved[0]), 0.0])
                noise = case.fixes.position_noise**2 * np.eye(2)
                self.localizer.on_fix(Fix(fix.stamp, (0, 1), fix.pose[:2] + off, noise))
        if case.imu.enabled:
            self.localizer.on_imu(stamp, sample.yaw_rate, *sample.force[:2].tolist())
        located = self.localizer.on_encoders(stamp, right, left)
        self.record.filter_time += time.perf_counter() - began
        said, self.localizer.remarks = self.localizer.remarks, []
        self.record.remarks += [f"{now:.2f} s: {remark}" for remark in said]
        return located


@dataclass(frozen=True)
class Figures:
    """Of one run, or of many of the same case."""

    off: Array  # (n, 3) output less truth [m], [rad]
    inner: Array  # (n, 3) the filter's estimate less truth
    time: Array  # (n,) [s]
    nees: Array  # (n,) of the output
    away: Array  # (n,) true distance from the reference [m]
    roughness: float  # RMS of a torque's change in a period [N m]
    step: float  # largest step of the output in a period beyond the truth's [m]
    share: float  # of a core that the filter takes at 200 Hz


def figures(loop: Loop) -> Figures:
    """Figures of a run."""
    rows = np.array(loop.record.rows)
    now, pose, off, inner = rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:10]
    covariance = rows[:, 10:].reshape(-1, 3, 3)
    nees = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off)
    along, across, _ = tracking_error(pose, RUN.trajectory.at(now))
    sent = np.array(loop.sent)
    return Figures(
        off,
        inner,
        now,
        nees,
        np.hypot(along, across),
        float(np.sqrt(np.mean(np.diff(sent, axis=0) ** 2))),
        float(np.hypot(*np.diff(off[:, :2], axis=0).T).max()),
        loop.record.filter_time / (len(rows) * PERIOD),
    )


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))
