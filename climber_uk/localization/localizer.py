"""Where the climber is: takes samples of encoders and IMU, and fixes, in the order they come in."""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.localization import models
from climber_uk.localization.doubts import Doubts
from climber_uk.localization.encoders import Encoders, Rolled
from climber_uk.localization.gate import Fix, Gate, corrected_by, told_anew
from climber_uk.localization.history import History, Sample
from climber_uk.localization.imu import DELAY, Imu, Weight
from climber_uk.localization.kalman import LARGEST_KNOCK, Estimate
from climber_uk.localization.models import (
    ASIDE,
    BIAS,
    FORCE_BIASES,
    FORWARD_BIAS,
    HEADING,
    SCALE,
    SLIPS,
    Travel,
    X,
    Y,
    heading_by_force_biases,
    turn,
)
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.output_speed import OutputSpeed
from climber_uk.localization.scrubbing import Push, Scrubbing
from climber_uk.localization.smoothing import Smoothing
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import GRAVITY
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Motion

DISAGREES = 0.5  # [s] of gravity that tells another heading, after which it is believed
LEAP = 1.0  # [s] between two stamps, from which on one alone is taken for a mistake
EARLIEST = 0.001  # [s] that the first sample of the encoders stands for
MOST_EARLY = 20  # fixes that wait for the encoders
SPEED_NOISE = 0.003  # [m/s] of a speed by encoders, deviation


class Located(NamedTuple):
    """What there is to publish of a stamp."""

    stamp: int  # [ns]
    motion: Motion
    pose_covariance: Array  # (3, 3) of x, y, θ
    twist_variances: tuple[float, float]  # of speed and yaw rate
    aside: float = 0.0  # [m/s] to the left, at which wheels that scrub give way


class Counts(NamedTuple):
    """How many fixes were taken, refused, and believed against the estimate."""

    taken: int = 0
    refused: int = 0
    believed: int = 0


class Localizer:
    """Filter, gate and output together; `remarks` collects what is to be said."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.options = options
        self.remarks: list[str] = []  # for whoever reads, and empties it
        self._start()

    def _start(self) -> None:
        options = self.options
        self.history = History(options, Estimate.start(options))
        self.encoders, self.imu = Encoders(options), Imu(options.imu_x, options.imu_y)
        self.gate, self.smoothing = Gate(options), Smoothing(options)
        self.counts, self.doubts = Counts(), Doubts(options)
        self.stamp: int | None = None  # [ns] of the last sample of the encoders
        self._leapt: int | None = None  # [ns] the last stamp, if it was far off that
        self.last_was_taken = True  # of the fixes
        self.fixed: int | None = None  # [ns] stamp of the last fix that was taken
        self.located: Located | None = None
        self._early: list[Fix] = []  # that are ahead of the encoders
        self._disagrees = 0.0  # [s]
        self._is_first = False  # whether gravity's first samples tell the heading, each anew
        self._scrubbing = Scrubbing()
        self._aside = 0.0  # [m/s] u
        self._output = OutputSpeed(options.output_frequency, options.scrubs)

    @property
    def estimate(self) -> Estimate:
        """The filter's, of the last sample of the encoders."""
        return self.history.latest

    @property
    def knows_heading(self) -> bool:
        """Whether the heading is known well enough to begin with."""
        return self.estimate.deviation(HEADING) <= self.options.initial_heading_limit

    @property
    def knows_position(self) -> bool:
        """Whether the position is known well enough to begin with."""
        furthest = max(self.estimate.deviation(X), self.estimate.deviation(Y))
        return furthest <= self.options.initial_position_limit

    def on_imu(self, stamp: int, yaw_rate: float, forwards: float, left: float) -> None:
        """Take yaw rate [rad/s] and specific force [m/s²] at `stamp` [ns], in the body's frame."""
        self.imu.add(stamp, yaw_rate, forwards, left)

    def on_encoders(self, stamp: int, right: float, left: float) -> Located | None:
        """Take the wheels' angles [rad] at `stamp` [ns]; None while too little is known.

        What has no newer stamp gets the answer of before, if there was one. Raises as
        `Encoders.roll` does.
        """
        if self._leaps(stamp):
            return self.located
        if self.stamp is not None and self.stamp - stamp >= LEAP * SECOND:
            self.remarks.append("stamps went back: started anew")
            self._start()
        if self.stamp is not None and (
            stamp < self.stamp or (stamp == self.stamp and self.located)
        ):
            return self.located
        duration = max(EARLIEST, (stamp - (self.stamp or stamp)) / SECOND)
        self.stamp = stamp
        rolled = self.encoders.roll(right, left, duration)
        sample, weight = self._sample(rolled)
        self.history.add(stamp, sample)
        travel = sample.travel
        # at rest a gyro's noise tells of turns all the time, and of no way
        rests = sample.rests and travel.is_gyro
        turned = math.inf if rests else turn(self.estimate.mean, travel)
        self.smoothing.go_on(duration, travel.distance, turned)
        if weight is not None:
            self._watch_gravity(weight)
        early, self._early = self._early, []
        for fix in early:
            self.on_fix(fix)
        if self.located or (self.knows_heading and self.knows_position):
            self.located = self._locate(rolled, travel)
            self.doubts.look(self.estimate)
        return self.located

    def _leaps(self, stamp: int) -> bool:
        """Whether a stamp [ns] is far off the one before, and the last that was is elsewhere."""
        ahead = 0.0 if self.stamp is None else (stamp - self.stamp) / SECOND
        before, self._leapt = self._leapt, stamp if abs(ahead) >= LEAP else None
        if self._leapt is None or (before is not None and abs(stamp - before) < LEAP * SECOND):
            return False
        self.remarks.append(f"a stamp of the encoders is {ahead:+.3g} s off the last: left out")
        return True

    def _sample(self, rolled: Rolled) -> tuple[Sample, Weight | None]:
        assert self.stamp is not None
        is_gyro = self.imu.is_there(self.stamp)
        yaw_rate, forwards = self.imu.means() if is_gyro else (rolled.yaw_rate, None)
        travel = Travel(rolled.duration, rolled.distance, rolled.path, yaw_rate, is_gyro)
        aside = 0.0
        if self.options.scrubs:
            travel, rolled, aside = self._scrubbed(rolled, travel, forwards)
        self._aside = aside
        weight = self.imu.weight(rolled, yaw_rate, aside) if is_gyro else None
        if self._scrubbing.breaks_away:
            weight = None
        counts = weight is not None and self.knows_heading and not weight.has_only_begun
        return Sample(travel, weight if counts else None, rolled.rests), weight

    def _scrubbed(
        self, rolled: Rolled, travel: Travel, forwards: float | None
    ) -> tuple[Travel, Rolled, float]:
        """The travel of wheels that scrub, what they have rolled but for slip, and u [m/s].

        It is the wheels' where there is no specific force `forwards` [m/s²].
        """
        options, mean, duration = self.options, self.estimate.mean, rolled.duration
        angle = turn(mean, travel)
        if forwards is None:
            return travel._replace(scrubbed=abs(angle)), rolled, 0.0
        turned = self._scrubbing.turned(rolled, angle / duration, options)
        heading, pull = float(mean[HEADING]), models.share_along_wall(options)
        uphill = pull * math.sin(heading)
        slips, ways = mean[SLIPS].tolist(), mean[ASIDE].tolist()
        slip = models.slip_along(slips, turned.slipped, turned.dragged, uphill)
        aside = pull * models.slip_aside(ways, heading, angle, turned.angle) / duration
        push = None
        if self.knows_heading:
            yaw_rate = angle / duration
            forwards += yaw_rate * aside - float(mean[FORWARD_BIAS]) - GRAVITY * uphill
            push = Push(forwards, yaw_rate, options.imu_y)
        distance, slipped, dragged = self._scrubbing.go_on(rolled, push, turned, slip)
        distance += models.slip_along(slips, slipped, dragged, uphill)
        travel = travel._replace(
            distance=distance, scrubbed=turned.angle, slipped=slipped, dragged=dragged
        )
        return travel, rolled._replace(distance=rolled.distance - slip), aside

    def _watch_gravity(self, weight: Weight) -> None:
        """Take the heading from gravity where nothing else tells it, or all tells another one."""
        options, pull = self.options, self.options.gravity_along_wall
        if pull == 0:
            return
        # twice the mean of the same samples has twice its variance
        noise = options.acceleration_noise * math.sqrt(2 / weight.known) / pull
        deviation = math.hypot(noise, options.gyro_noise * math.sqrt(DELAY))  # of its turn since
        mean, covariance = self.estimate.mean, self.estimate.covariance
        forwards, left = (np.array([weight.forwards, weight.left]) - mean[FORCE_BIASES]).tolist()
        heading = math.atan2(forwards, left) + weight.turned
        by_biases = heading_by_force_biases(heading, pull)
        if not self.knows_heading or self._is_first:
            biases = covariance[np.ix_(FORCE_BIASES, FORCE_BIASES)]
            if math.sqrt(deviation**2 + by_biases @ biases @ by_biases) <= (
                options.initial_heading_limit
            ):
                self._believe(heading, deviation)
                self._is_first = weight.has_only_begun
            return
        off = wrapped(heading - float(mean[HEADING]))
        rows = [HEADING, *FORCE_BIASES]
        by_state = np.array([1.0, *-by_biases])
        variance = options.acceleration_noise**2 / weight.time / pull**2
        variance += float(by_state @ covariance[np.ix_(rows, rows)] @ by_state)
        disagrees = off**2 > LARGEST_KNOCK * variance
        self._disagrees = self._disagrees + weight.time if disagrees else 0.0
        if self._disagrees > DISAGREES:
            self.remarks.append(
                f"heading: gravity tells {math.degrees(off):.2g}° more for {DISAGREES} s: believed"
            )
            self._believe(heading, deviation)

    def _believe(self, heading: float, deviation: float) -> None:
        self._disagrees, before = 0.0, self.estimate.mean[:3]
        near = float(before[HEADING]) + wrapped(heading - float(before[HEADING]))
        last = len(self.history.entries) - 1
        pull = self.options.gravity_along_wall
        self.history.correct(
            last, lambda estimate: estimate.with_heading(near, deviation, pull), anew=True
        )
        self._smooth(before)

    def on_fix(self, fix: Fix) -> None:
        """Take a fix, at its own stamp; remark on what is refused, or believed after all."""
        if self.stamp is None or fix.stamp > self.stamp:
            ahead = (fix.stamp - (self.stamp or fix.stamp)) / SECOND
            if ahead > self.options.longest_delay:
                self._refuse(f"{ahead:.3g} s ahead of the encoders")
            else:
                self._early = [*self._early, fix][-MOST_EARLY:]
            return
        number = self.history.at(fix.stamp)
        if number is None:
            age, longest = (self.stamp - fix.stamp) / SECOND, self.options.longest_delay
            why = f"longest_delay={longest:g}" if age > longest else "the first of the encoders"
            self._refuse(f"{age:.3g} s old, older than {why}")
            return
        entry = self.history.entries[number]
        since = entry.pose(fix.stamp) - entry.estimate.mean[:3]
        fix = fix._replace(values=fix.values - since[list(fix.parts)])
        verdict = self.gate.judge(entry.estimate, fix)
        if not verdict.taken:
            self._refuse(verdict.said)
            return
        after = told_anew if verdict.believed else corrected_by
        before = self.estimate.mean[:3]
        self.history.correct(number, lambda estimate: after(estimate, fix), verdict.believed)
        self._smooth(before)
        self.fixed, self.last_was_taken = fix.stamp, True
        self.doubts.on_fix(fix.stamp)
        taken, _, believed = self.counts
        self.counts = self.counts._replace(taken=taken + 1, believed=believed + verdict.believed)
        if verdict.believed:
            self.remarks.append(f"fix {verdict.said}")

    def _refuse(self, why: str) -> None:
        self.last_was_taken = False
        self.counts = self.counts._replace(refused=self.counts.refused + 1)
        self.remarks.append(f"fix refused: {why}")

    def _smooth(self, before: Array) -> None:
        """Let the output go on from where it was, once there is one."""
        if self.located:
            self.smoothing.corrected(before, self.estimate.mean[:3])

    def _locate(self, rolled: Rolled, travel: Travel) -> Located:
        """What is published."""
        assert self.stamp is not None
        mean, offset, duration = self.estimate.mean, self.smoothing.offset, travel.duration
        x, y, heading = (mean[:3] + offset).tolist()
        gyro = turn(mean, travel) / duration
        uphill = models.share_along_wall(self.options) * math.sin(float(mean[HEADING]))
        distance = models.forwards(mean, travel, uphill)
        speed, yaw_rate = self._output.go_on(distance, rolled.yaw_rate, gyro, duration)
        scale, bias = self.estimate.deviation(SCALE), self.estimate.deviation(BIAS)
        return Located(
            self.stamp,
            Motion.at(x, y, heading, speed, yaw_rate),
            self.estimate.covariance[:3, :3] + np.outer(offset, offset),
            ((speed * scale) ** 2 + SPEED_NOISE**2, bias**2 + self.options.gyro_noise**2 / DELAY),
            self._aside,
        )
