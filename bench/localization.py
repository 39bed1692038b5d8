"""`python bench/localization.py`: where the climber believes to be, and where it is, row by row.

Lock-step at 200 Hz, in one process: the simulated robot with encoders, an IMU and fixes, the filter
of `wall_odometry`, and the controller, which is told nothing else. The figure of eight of
config/climber.yaml, 57 s; the sensors are those of config/field.yaml unless a row says otherwise.
"""

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from identification_experiments import SCENARIOS
from scipy.stats import chi2

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.timing import Timing
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Localizer, Located
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.mechanics.shapes import Lemniscate
from climber_uk.simulation.field_sensors import EncoderErrors, FieldSensors, FixErrors, ImuErrors
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

RUN = SCENARIOS["climber.yaml"]
PERIOD = 0.005  # [s] of control, sensors and plant
MILLIMETRE = 1e-3
DRAWS = 17  # second part of a seed, that no sensor has
TIMED = 21  # samples from one to the next of which the processor's time is asked: slow itself
# 0.1°/√s and 0.5°/s; 0.05 m/s² at 200 Hz
IMU = ImuErrors(
    enabled=True,
    gyro_noise=math.radians(0.1),
    gyro_bias=math.radians(0.5),
    acceleration_noise=0.05 * math.sqrt(PERIOD),
)
ENCODERS = EncoderErrors(resolution=2 * math.pi / 4096, slip=0.01)
FIXES = FixErrors(period=0.1, delay=0.1, position_noise=0.025)
FILTER = LocalizationOptions(
    gyro_noise=IMU.gyro_noise,
    acceleration_noise=IMU.acceleration_noise,
    initial_y=3.0,
    initial_heading=math.pi / 4,
    way_noise=5e-4,
    output_frequency=65.0,
)


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
    size: float = 1.0  # of the figure of eight, by that of config/climber.yaml
    rests: bool = False  # at any heading, without a controller
    believes_truth: bool = False  # whether the controller gets perfect odometry
    is_drawn: bool = False  # whether place, biases and creep are chance, as the filter believes

    def drawn(self, seed: int) -> "Case":
        """The same with a start, biases and creep drawn from the filter's own deviations."""
        if not self.is_drawn:
            return self
        options = self.options
        chance = np.random.default_rng([seed, DRAWS]).normal(size=7).tolist()
        place = options.initial_position_deviation
        force = options.acceleration_bias_deviation
        imu = replace(
            self.imu,
            gyro_bias=chance[0] * options.gyro_bias_deviation,
            forward_bias=chance[1] * force,
            left_bias=chance[2] * force,
        )
        heading = options.initial_heading_deviation
        options = replace(
            options,
            initial_x=options.initial_x + chance[3] * place,
            initial_y=options.initial_y + chance[4] * place,
            initial_heading=options.initial_heading
            + chance[6] * heading * (heading <= options.initial_heading_limit),
        )
        creep = abs(options.initial_creep + chance[5] * options.creep_deviation)
        return replace(self, imu=imu, options=options, creep=creep)


@dataclass
class Record:
    """What a run leaves: one row for each odometry."""

    rows: list[list[float]] = field(default_factory=list)
    waited: list[float] = field(default_factory=list)  # [s] by the reference until then
    remarks: list[str] = field(default_factory=list)
    filter_time: float = 0.0  # [s] of the processor
    fault: str = ""  # the controller's first, and when

    def add(self, now: float, robot: SimulatedRobot, located: Located) -> None:
        """Add where the climber is and where it believes to be."""
        motion, covariance = located.motion, located.pose_covariance
        off = np.array([motion.x, motion.y, motion.heading]) - robot.state.pose
        off[2] = wrapped(float(off[2]))
        self.rows.append([now, *robot.state.pose, *off, *covariance.ravel()])


class Loop:
    """One closed loop of a case."""

    def __init__(self, case: Case, seed: int) -> None:
        self.case = case = case.drawn(seed)
        believed = replace(RUN.believed, inclination=case.inclination)
        options = ControlOptions() if case.believes_truth else ControlOptions(friction_speed=0.01)
        law = ControlLaw(believed, RUN.guidance, options)
        self.controller = Controller(Settings(law, timing=Timing(control_period=PERIOD)))
        turned = np.random.default_rng(seed).uniform(-math.pi, math.pi) if case.rests else 0.0
        pose = RUN.start.pose + np.array([0.0, 0.0, turned])
        start = State(pose, np.zeros(3))
        physics = Physics(creep=case.creep)
        parts = Parts(Plant(believed, PERIOD), Motors(), Sensors(), physics)
        self.robot: Any = SimulatedRobot(parts, start, PERIOD)
        shape = Lemniscate(1.5 * case.size, 0.75 * case.size)
        self.trajectory = replace(RUN.trajectory, shape=shape)
        self.sense(start, seed)

    def sense(self, start: State, seed: int) -> None:
        """Begin with sensors and filter."""
        case = self.case
        seeded = [
            replace(errors, seed=3 * seed + number)
            for number, errors in enumerate((case.imu, case.encoders, case.fixes))
        ]
        self.sensors = FieldSensors(*seeded, PERIOD, start)
        self.localizer = Localizer(replace(case.options, inclination=case.inclination))
        self.torques: Array = np.zeros(2)
        self.record, self.sent = Record(), []

    def run(self) -> "Loop":
        """Go through it."""
        case = self.case
        self.controller.on_reference(0, sampled(self.trajectory, case.duration))
        for number in range(round(case.duration / PERIOD) + 1):
            now = number * PERIOD
            stamp = SECOND + round(now * SECOND)
            if number > 0:
                self.robot.measure()
            located = self.locate(stamp, now)
            if located is not None:
                self.record.add(now, self.robot, located)
                self.record.waited.append(self.controller.active.waited)
                if case.rests:
                    continue
                motion = self.robot.state.motion if case.believes_truth else located.motion
                answer = self.controller.on_odometry(stamp, stamp, motion, located.aside)
                if answer is not None:
                    self.torques = answer.torques
                if self.controller.mode.is_fault and not self.record.fault:
                    mode, detail = self.controller.mode, self.controller.detail
                    self.record.fault = f"{now:.2f} s: {mode.value}: {detail}"
            self.sent.append(self.torques)
            for _ in range(round(PERIOD / self.robot.plant.step)):
                self.robot.advance(self.torques)
        return self

    def locate(self, stamp: int, now: float) -> Located | None:
        """Have the sensors measure, and the filter take it."""
        case, robot = self.case, self.robot
        measured = self.sensors.measure(stamp, robot.state, robot.plant, robot.angles)
        right, left = measured.angles.tolist()
        is_timed = round(now / PERIOD) % TIMED == 0
        began = time.process_time() if is_timed else 0.0
        for fix in measured.fixes:
            measured_at = fix.stamp / SECOND - 1
            if not case.gap[0] <= measured_at < case.gap[1]:
                off = np.array([case.moved[1] * (measured_at >= case.moved[0]), 0.0])
                noise = case.fixes.position_noise**2 * np.eye(2)
                lever = case.fixes.x, case.fixes.y
                self.localizer.on_fix(Fix(fix.stamp, (0, 1), fix.pose[:2] + off, noise, lever))
        if measured.imu is not None:
            force = measured.imu.force[:2].tolist()
            self.localizer.on_imu(stamp, measured.imu.yaw_rate, *force)
        located = self.localizer.on_encoders(stamp, right, left)
        if is_timed:
            self.record.filter_time += TIMED * (time.process_time() - began)
        said, self.localizer.remarks = self.localizer.remarks, []
        self.record.remarks += [f"{now:.2f} s: {remark}" for remark in said]
        return located


NO_FIXES = FixErrors()
ROWS = {
    "perfect odometry for the controller": Case(believes_truth=True),
    "all of it": Case(),
    "heading unknown, 1 s at rest": Case(rests=True, duration=1.0),
    "fixes of 50 mm at 5 Hz, 200 ms late": Case(fixes=FixErrors(0.2, 0.2, 0.05)),
    "fixes of 25 mm at 1 Hz, 100 ms late": Case(fixes=FixErrors(1.0, 0.1, 0.025)),
    "no fixes from 20 to 50 s": Case(gap=(20.0, 50.0)),
    "no fixes at all, 1 % creep": Case(fixes=NO_FIXES, creep=0.01),
    "no fixes at all, 1 % creep, 2 m by 1 m": Case(fixes=NO_FIXES, creep=0.01, size=2 / 3),
    "no fixes, 1 % creep, known from a bag": Case(
        fixes=NO_FIXES,
        creep=0.01,
        options=replace(FILTER, initial_creep=0.01, creep_deviation=0.002),
    ),
    "a tag 0.3 m from the centre": Case(fixes=replace(FIXES, x=0.25, y=-0.17)),
    "5 % of fixes off by 3 m": Case(fixes=replace(FIXES, outlier_share=0.05)),
    "fixes off by 0.5 m from 25 s on": Case(moved=(25.0, 0.5)),
    "IMU off by 0.02 g forwards": Case(imu=replace(IMU, forward_bias=0.2)),
    "no IMU": Case(
        imu=ImuErrors(), options=replace(FILTER, initial_heading_deviation=math.radians(2))
    ),
    "wall of 20°": Case(inclination=20.0),
    "floor, heading known to 2° at the start": Case(
        inclination=0.0, options=replace(FILTER, initial_heading_deviation=math.radians(2))
    ),
}
HEAD = "mm rms, max | deg | mm/s in gap | mm true | N m | mm | NEES | fixes | core"
# what the columns are, for --help
COLUMNS = """mm: RMS and largest distance of the output from the truth; deg: RMS and, from 1 s on,
largest error of the heading; mm/s: growth of the distance in the gap; mm: RMS and largest true
distance from the reference; N m: RMS change of a torque in a period; mm: largest step of the output
in a period; NEES of the pose: mean, least and largest mean of a seed, and shares of the time in
which the mean of the seeds is below, within and above its 95 % bounds; fixes taken, refused,
believed against the estimate (means); share of a core at 200 Hz.
"""


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def figures(loops: list[Loop]) -> str:
    """Line of the table: figures of the runs of one case."""
    case = loops[0].case
    rows = np.array([loop.record.rows for loop in loops])  # (seeds, n, ...)
    now, pose, off = rows[0, :, 0], rows[..., 1:4], rows[..., 4:7]
    covariance = rows[..., 7:].reshape(*rows.shape[:2], 3, 3)
    nees = np.einsum("sni,snij,snj->sn", off, np.linalg.inv(covariance), off)
    bounds = chi2.ppf((0.025, 0.975), 3 * len(loops)) / len(loops)
    mean, of_seeds = nees.mean(axis=0), nees.mean(axis=1)
    low, high = (mean < bounds[0]).mean(), (mean > bounds[1]).mean()
    distance = np.hypot(off[..., 0], off[..., 1])
    waited = np.array([loop.record.waited for loop in loops])
    desired = loops[0].trajectory.at(now - waited)
    along, across, _ = tracking_error(pose, desired)
    away = np.hypot(along, across)
    sent = np.array([loop.sent for loop in loops])
    step = np.hypot(*np.moveaxis(np.diff(off[..., :2], axis=1), 2, 0)).max()
    counts = np.mean([loop.localizer.counts for loop in loops], axis=0)
    said = [
        f"{rms(distance) / MILLIMETRE:6.1f}{distance.max() / MILLIMETRE:7.1f}",
        f"{np.degrees(rms(off[..., 2])):7.3f}{np.degrees(np.abs(off[:, now >= 1, 2]).max()):7.3f}",
        f"{growth(distance, now, case) / MILLIMETRE:6.2f}",
        f"{rms(away) / MILLIMETRE:6.1f}{away.max() / MILLIMETRE:7.1f}",
        f"{rms(np.diff(sent, axis=1)):7.4f}",
        f"{step / MILLIMETRE:6.2f}",
        f"{nees.mean():6.2f} ({of_seeds.min():.2f} to {of_seeds.max():.2f}){low:5.0%}"
        f"{1 - low - high:5.0%}{high:5.0%}",
        " / ".join(f"{count:.1f}" for count in counts),
        f"{np.mean([loop.record.filter_time for loop in loops]) / (len(now) * PERIOD):5.1%}",
    ]
    return " |".join(said)


def print_faults(loops: Sequence[Loop]) -> None:
    """Tell which of the runs, one for each seed, the controller has stopped."""
    for seed, loop in enumerate(loops):
        if loop.record.fault:
            print(f"  seed {seed}, stopped at {loop.record.fault}", flush=True)


def growth(distance: Array, now: Array, case: Case) -> float:
    """Mean over the seeds of how fast the distance (seeds, n) grows in the gap [m/s]."""
    begin, end = case.gap
    if begin == end:
        return math.nan
    at = [np.searchsorted(now, time) for time in (begin, end)]
    return float((distance[:, at[1]] - distance[:, at[0]]).mean() / (end - begin))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=COLUMNS, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20, help="runs of each row (default: 20)")
    parser.add_argument("--only", default="", help="rows whose name contains this")
    parser.add_argument(
        "--drawn", action="store_true", help="start, biases and creep of each row as is believed"
    )
    parser.add_argument("--duration", type=float, default=math.inf, help="[s] of a run, at most")
    options = parser.parse_args()
    print(f"{'':<42}{HEAD}")
    for name, case in ROWS.items():
        if options.only in name:
            duration = min(case.duration, options.duration)
            case = replace(case, is_drawn=case.is_drawn or options.drawn, duration=duration)
            loops = [Loop(case, seed).run() for seed in range(options.seeds)]
            print(f"{name:<42}{figures(loops)}", flush=True)
            print_faults(loops)


if __name__ == "__main__":
    main()
