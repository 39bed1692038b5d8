"""`python bench/robot_localization.py`: `wall_odometry`'s filter beside that of robot_localization.

The equations of its `ekf_node` with `two_d_mode` and `smooth_lagged_data`: constant acceleration,
(x, y, yaw, vx, vy, vyaw, ax, ay), with the process noise of its params/ekf.yaml, and with one that
is tuned to these sensors. It gets the encoders' twist, the gyro's yaw rate and the fixes, and is
told the heading at the start; accelerations it cannot take on a wall, where gravity is part of
them. All are told the same, of runs of `bench/localization.py` whose controller knows the truth.
"""

import argparse
import math
from collections import deque
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from localization import FIXES, NO_FIXES, PERIOD, Case, Loop, rms

from climber_uk.localization.encoders import Encoders
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Located
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped

X, Y, YAW, V_X, V_Y, V_YAW, A_X, A_Y = range(8)
# variances that a second adds
PROCESSES = {
    "params/ekf.yaml": np.diag([0.05, 0.05, 0.06, 0.025, 0.025, 0.02, 0.01, 0.01]),
    "tuned": np.diag([1e-6, 1e-6, 3e-6, 0.025, 0.025, 0.5, 0.01, 0.01]),
}
SPEED_NOISE = 0.01  # [m/s] of the encoders, and of a speed aside of 0
YAW_RATE_NOISE = 0.02  # [rad/s] of the encoders
KEPT = SECOND  # [ns] for which states are kept


class Step(NamedTuple):
    """State and covariance at a stamp, and what was measured then."""

    stamp: int
    mean: Array
    covariance: Array
    measured: list[tuple[list[int], Array, Array]]  # parts, values, variances


class RobotLocalization:
    """Predicts, and corrects; a late fix goes back to its stamp, and does again what came after."""

    def __init__(self, start: Array, options: LocalizationOptions, process: Array) -> None:
        self.process = process
        mean = np.array([*start, *[0.0] * 5])
        self.steps = deque([Step(SECOND, mean, 1e-4 * np.eye(8), [])])
        self.encoders, self.gyro_noise = Encoders(options), options.gyro_noise
        self.yaw_rate: float | None = None

    def on_imu(self, yaw_rate: float) -> None:
        """Take a yaw rate [rad/s]."""
        self.yaw_rate = yaw_rate

    def on_encoders(self, stamp: int, right: float, left: float) -> Array:
        """Take angles [rad]; the pose (3,)."""
        duration = max((stamp - self.steps[-1].stamp) / SECOND, 1e-3)
        rolled = self.encoders.roll(right, left, duration)
        twist = np.array([rolled.speed, 0.0, rolled.yaw_rate])
        noise = np.array([SPEED_NOISE, SPEED_NOISE, YAW_RATE_NOISE]) ** 2
        measured = [([V_X, V_Y, V_YAW], twist, noise)]
        if self.yaw_rate is not None:
            variance = np.array([self.gyro_noise**2 / PERIOD])
            measured.append(([V_YAW], np.array([self.yaw_rate]), variance))
        self.steps.append(go_on(self.steps[-1], stamp, measured, self.process))
        while self.steps[1].stamp < stamp - KEPT:
            self.steps.popleft()
        return self.steps[-1].mean[:3]

    def on_fix(self, fix: Fix) -> None:
        """Take a fix at its stamp."""
        later = []
        while len(self.steps) > 1 and self.steps[-1].stamp > fix.stamp:
            later.append(self.steps.pop())
        at = self.steps.pop()
        told = [(list(fix.parts), fix.values, np.diag(fix.noise))]
        self.steps.append(corrected(at, told)._replace(measured=at.measured + told))
        for step in reversed(later):
            self.steps.append(go_on(self.steps[-1], step.stamp, step.measured, self.process))


def go_on(
    step: Step, stamp: int, measured: list[tuple[list[int], Array, Array]], process: Array
) -> Step:
    """Predict to a stamp [ns], and correct by what is measured then."""
    time = (stamp - step.stamp) / SECOND
    x, y, yaw, v_x, v_y, v_yaw, a_x, a_y = step.mean.tolist()
    cosine, sine, half = math.cos(yaw), math.sin(yaw), time * time / 2
    ahead, aside = v_x * time + a_x * half, v_y * time + a_y * half
    mean = np.array(
        [
            *(x + cosine * ahead - sine * aside, y + sine * ahead + cosine * aside),
            *(yaw + v_yaw * time, v_x + a_x * time, v_y + a_y * time, v_yaw, a_x, a_y),
        ]
    )
    jacobian = np.eye(8)
    jacobian[X, [YAW, V_X, V_Y, A_X, A_Y]] = (
        *(-sine * ahead - cosine * aside, cosine * time, -sine * time),
        *(cosine * half, -sine * half),
    )
    jacobian[Y, [YAW, V_X, V_Y, A_X, A_Y]] = (
        *(cosine * ahead - sine * aside, sine * time, cosine * time),
        *(sine * half, cosine * half),
    )
    jacobian[YAW, V_YAW] = jacobian[V_X, A_X] = jacobian[V_Y, A_Y] = time
    covariance = jacobian @ step.covariance @ jacobian.T + time * process
    return corrected(Step(stamp, mean, covariance, measured), measured)


def corrected(step: Step, measured: list[tuple[list[int], Array, Array]]) -> Step:
    """Correct by measurements."""
    mean, covariance = step.mean, step.covariance
    for parts, values, variances in measured:
        noise = covariance[np.ix_(parts, parts)] + np.diag(variances)
        gain = np.linalg.solve(noise, covariance[parts]).T
        mean = mean + gain @ (values - mean[parts])
        covariance = covariance - gain @ covariance[parts]
    return step._replace(mean=mean, covariance=covariance)


class Others:
    """In the place of a `Localizer`: tells it, and other filters beside it."""

    def __init__(self, loop: Loop) -> None:
        self.ours, self.robot = loop.localizer, loop.robot
        start, options = loop.robot.state.pose, loop.case.options
        self.others = {
            name: RobotLocalization(start, options, process) for name, process in PROCESSES.items()
        }
        self.off: dict[str, list[Array]] = {name: [] for name in PROCESSES}
        self.remarks: list[str] = []

    def on_imu(self, stamp: int, yaw_rate: float, *force: float) -> None:
        """See `Localizer`."""
        self.ours.on_imu(stamp, yaw_rate, *force)
        for other in self.others.values():
            other.on_imu(yaw_rate)

    def on_fix(self, fix: Fix) -> None:
        """See `Localizer`."""
        self.ours.on_fix(fix)
        for other in self.others.values():
            other.on_fix(fix)

    def on_encoders(self, stamp: int, right: float, left: float) -> Located | None:
        """See `Localizer`."""
        for name, other in self.others.items():
            off = other.on_encoders(stamp, right, left) - self.robot.state.pose
            off[2] = wrapped(float(off[2]))
            self.off[name].append(off)
        return self.ours.on_encoders(stamp, right, left)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="runs of each row (default: 5)")
    parser.add_argument("--duration", type=float, default=57.0, help="[s] (default: 57)")
    options = parser.parse_args()
    print(f"{'':<44}{'mm rms':>8}{'at end':>8}{'deg rms':>9}")
    for name, fixes, creep in (
        ("fixes of 25 mm at 10 Hz", FIXES, 0.03),
        ("fixes of 25 mm at 1 Hz", replace(FIXES, period=1.0), 0.03),
        ("no fixes, 1 % creep", NO_FIXES, 0.01),
    ):
        case = Case(believes_truth=True, fixes=fixes, creep=creep, duration=options.duration)
        loops = [Loop(case, seed) for seed in range(options.seeds)]
        for loop in loops:
            loop.localizer = Others(loop)  # type: ignore[assignment]
            loop.run()
        errors = {"ours": [np.array(loop.record.rows)[:, 4:7] for loop in loops]}
        for other in PROCESSES:
            errors[other] = [np.array(loop.localizer.off[other]) for loop in loops]  # type: ignore[attr-defined]
        for whose, off in errors.items():
            of_all = np.concatenate(off)
            distance = 1e3 * rms(np.hypot(of_all[:, 0], of_all[:, 1]))
            end = 1e3 * rms(np.array([np.hypot(*run[-1, :2]) for run in off]))
            heading = np.degrees(rms(of_all[:, 2]))
            print(f"{name:<26}{whose:<18}{distance:8.1f}{end:8.1f}{heading:9.3f}", flush=True)


if __name__ == "__main__":
    main()
