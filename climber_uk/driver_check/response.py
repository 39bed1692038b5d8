"""Response of a climber to torques or speeds, fitted to pulses of the pairs τR = ±τL or ωR = ±ωL.

    speed(t) = speed₀ + G ∫ τ(t - L) dt + c t - κ ∫ speed dt

while it slides in one direction: c and κ stand for friction and weight. By (11) and (15)
G = 2/(r m) for the drive and 2 d/(r J) for the turn. A speed that is the mean of the period before
its stamp, as of encoders, is that of the period's middle. What resists a turn is c and κ of its
pulses, by J. Of a board that takes speeds,

    speed(t) = G y(t - L),   ẏ = (ω* - y) / T

with the time constant T of its servo, and G = r for the drive and r/d for the turn; wheels that
scrub turn the climber by less, as if it were wider.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence, MotionSeen, TrialRecord
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber

PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])  # (right, left), to drive and to yaw
COARSE = 20  # delays that are tried, and again so many around the best
# of delay and time constant: points either way, and how often the best one's surroundings
GRID, REFINEMENTS = 3, 9
SETTLED = 0.7  # of a step's time, from which on the speed counts
LATTICE = range(-GRID, GRID + 1)
WIRINGS = {  # torque at the wheels (right, left) of the torques commanded
    "": [[1, 0], [0, 1]],
    "left and right are swapped": [[0, 1], [1, 0]],
    "both wheels turn the wrong way": [[-1, 0], [0, -1]],
    "left and right are swapped, and both turn the wrong way": [[0, -1], [-1, 0]],
    "the right wheel turns the wrong way": [[-1, 0], [0, 1]],
    "the left wheel turns the wrong way": [[1, 0], [0, -1]],
    "left and right are swapped, and the right one turns the wrong way": [[0, -1], [1, 0]],
    "left and right are swapped, and the left one turns the wrong way": [[0, 1], [-1, 0]],
    "the right wheel does nothing": [[0, 0], [0, 1]],
    "the left wheel does nothing": [[1, 0], [0, 0]],
}


def expected_gain(climber: Climber) -> Array:
    """Accelerations (2,) per torque of the wheels of each pair: [m/s² / N m], [rad/s² / N m]."""
    force, _ = climber.force_and_moment(PAIR[0])
    _, moment = climber.force_and_moment(PAIR[1])
    return np.array([force / climber.driven_mass, moment / climber.driven_inertia])


def expected_rim_gain(climber: Climber) -> Array:
    """Speeds (2,) per rate of the wheels of each pair: [m/s / rad/s], [rad/s / rad/s]."""
    return np.array([climber.wheel_radius, climber.wheel_radius / climber.half_track])


@dataclass(frozen=True)
class Fit:
    """Fit of one speed in one pulse."""

    gain: float  # per command of each wheel of the pair
    offset: float  # c
    drag: float  # κ [1/s]
    misfit: float  # sum of squares, by that of the speed


@dataclass(frozen=True)
class Response:
    """Gains of the pairs of commands, by those of the model; nan where it did not move."""

    gains: Array  # (2, 2): driving, yawing pair (rows) on forward speed, yaw rate (columns)
    offsets: Array  # (2, 2) c
    delay: float  # L [s]
    time_constant: float = 0.0  # T [s] of a board that takes speeds
    turning_friction: float = np.nan  # what resists a turn: Coulomb's [N m]
    turning_resistance: float = np.nan  # and in proportion to the yaw rate [N m s]

    @property
    def wiring(self) -> tuple[str, float]:
        """Key of `WIRINGS` whose gains are most similar, and their cosine similarity."""
        found = self.gains.copy()
        # what drives does not yaw; a driving pair may be less than the friction
        found[np.isnan(found[:, 1]) & np.isfinite(found[:, 0]), 1] = 0.0
        known = np.isfinite(found)
        likeness = {
            name: _cosine((PAIR @ np.array(wheels).T @ PAIR)[known], found[known])
            for name, wheels in WIRINGS.items()
        }
        best = max(likeness, key=lambda name: likeness[name])
        return best, likeness[best]


def respond(motion: MotionSeen, trial: TrialRecord, climber: Climber) -> Response:
    """Response with the delay and gains of the least misfit over all pulses."""
    if trial.takes_speeds:
        return respond_to_speeds(motion, trial, climber)
    at_rest = motion.stamp < trial.commands[0].time
    noise = np.std(motion.reaction[at_rest], axis=0) if at_rest.sum() > 1 else np.zeros(2)
    still = np.array([thresholds.STANDING_SPEED, thresholds.STANDING_RATE]) / 2
    floor = np.maximum(still, thresholds.NOISES * noise)
    fit_all = partial(_fit_all, motion, trial, floor)

    def misfit(delay: float) -> float:
        return sum(fit.misfit for found in fit_all(delay).values() for fit in found)

    step = thresholds.LONGEST_DELAY / COARSE
    coarse = min(np.arange(COARSE) * step, key=misfit)
    best = min(np.maximum(0, coarse + np.arange(-COARSE, COARSE) * step / COARSE), key=misfit)
    fits = fit_all(float(best))
    gains, offsets = np.full((2, 2), np.nan), np.full((2, 2), np.nan)
    for (turns, speed), found in fits.items():
        if found:
            gains[turns, speed] = np.mean([fit.gain for fit in found])
            offsets[turns, speed] = found[0].offset
    # J by the same fit: 2 d/r of each wheel's torque are a moment
    moments = [(abs(fit.offset), fit.drag) / np.abs(fit.gain) for fit in fits[1, 1] if fit.gain]
    resisted = np.mean(moments, axis=0) if moments else np.full(2, np.nan)
    resisted = resisted * 2 * climber.half_track / climber.wheel_radius
    return Response(gains / expected_gain(climber), offsets, float(best), 0.0, *resisted.tolist())


@dataclass(frozen=True)
class Steps:
    """Rates that a pair was commanded, step by step, and the n messages of its pulses."""

    times: Array  # of the steps [s]
    rates: Array  # from then on [rad/s]
    measured: Array  # times of the messages (n,) [s]
    speeds: Array  # both speeds in them (n, 2)
    steady: Array  # (n,) in which a servo has had time to reach its rate

    @classmethod
    def of(cls, motion: MotionSeen, trial: TrialRecord, pair: int) -> "Steps":
        """Those of one pair's pulses in a trial."""
        times = np.array([command.time - motion.stamp[0] for command in trial.commands]) / SECOND
        rates = np.array([command.rates for command in trial.commands]) @ PAIR[pair] / 2
        steps = np.append(True, np.diff(rates) != 0)
        times, rates = times[steps], rates[steps]
        during = np.zeros(len(motion.stamp), bool)
        for pulse in trial.pulses:
            if int(pulse.turns) == pair:
                during |= (motion.stamp >= pulse.begin) & (motion.stamp <= pulse.end)
        measured = motion.time[during] - (motion.period / 2 if motion.has_mean_twist else 0.0)
        now = np.clip(np.searchsorted(times, measured, "right") - 1, 0, None)
        until = np.append(times[1:], np.inf)[now]
        steady = (rates[now] != 0) & (measured - times[now] > SETTLED * (until - times[now]))
        return cls(times, rates, measured, motion.reaction[during], steady)

    def reached(self, delay: float, time_constant: float) -> Array:
        """Rate (n,) that a servo has reached in each message."""
        shares = np.exp(-np.diff(self.times) / time_constant)
        before = np.zeros(len(self.times))  # reached at the begin of each step
        for number, share in enumerate(shares.tolist()):
            before[number + 1] = self.rates[number] + (before[number] - self.rates[number]) * share
        since = self.measured - delay
        last = np.clip(np.searchsorted(self.times, since, "right") - 1, 0, None)
        left = np.exp(-np.maximum(0.0, since - self.times[last]) / time_constant)
        return self.rates[last] + (before[last] - self.rates[last]) * left

    def gains(self, reached: Array) -> Array:
        """Both speeds (2,) by the rate that a servo has reached, where that has settled."""
        reached, speeds = reached[self.steady], self.speeds[self.steady]
        return reached @ speeds / (reached @ reached)


def respond_to_speeds(motion: MotionSeen, trial: TrialRecord, climber: Climber) -> Response:
    """Response to rates; friction that is overcome first makes a pair later: the earlier counts."""
    pairs = sorted({int(pulse.turns) for pulse in trial.pulses})
    steps = [Steps.of(motion, trial, pair) for pair in pairs]
    delay, time_constant = min(map(_lateness, steps), key=sum)
    gains = np.full((2, 2), np.nan)
    for pair, commanded in zip(pairs, steps, strict=True):
        gains[pair] = commanded.gains(commanded.reached(delay, time_constant))
    gains /= expected_rim_gain(climber)
    return Response(gains, np.zeros((2, 2)), delay, time_constant)


def _lateness(steps: Steps) -> tuple[float, float]:
    """Delay L and time constant T [s] of the least misfit, by ever finer grids of L and ln T."""
    best, reach = np.array([thresholds.LONGEST_DELAY / 2, np.log(0.03)]), np.array([0.1, 3.0])

    def misfit(point: Array) -> float:
        reached = steps.reached(float(point[0]), math.exp(point[1]))
        left = steps.speeds - np.outer(reached, steps.gains(reached))
        return float(np.sum(left**2))

    for _ in range(REFINEMENTS):
        grid = [best + reach * [i, j] / GRID for i in LATTICE for j in LATTICE]
        best = min((np.maximum(point, [0.0, -9.0]) for point in grid), key=misfit)
        reach = reach / 2
    return float(best[0]), math.exp(best[1])


def _fit_all(
    motion: MotionSeen, trial: TrialRecord, floor: Array, delay: float
) -> dict[tuple[int, int], list[Fit]]:
    """Fits of each pulse that moved, by pair (0 drive, 1 yaw) and speed (0 forward, 1 yaw rate)."""
    begin = motion.stamp[0]
    moments = motion.time - (motion.period / 2 if motion.has_mean_twist else 0.0)
    times = np.array([command.time - begin for command in trial.commands]) / SECOND
    torques = np.array([command.torques for command in trial.commands])
    impulse = np.vstack([np.zeros((1, 2)), np.cumsum(torques[:-1] * np.diff(times)[:, None], 0)])
    fits: dict[tuple[int, int], list[Fit]] = {(p, s): [] for p in (0, 1) for s in (0, 1)}
    for pulse in trial.pulses:
        during = (motion.stamp >= pulse.begin) & (motion.stamp <= pulse.end)
        time = moments[during]
        right, left = (np.interp(time - delay, times, column) for column in impulse.T)
        pair = (right - left if pulse.turns else right + left) / 2
        for speed in (0, 1):
            fit = _fit(time, pair, motion.reaction[during, speed], floor[speed])
            if fit is not None:
                fits[int(pulse.turns), speed].append(fit)
    return fits


def _fit(time: Array, impulse: Array, speed: Array, floor: float) -> Fit | None:
    """Least-squares fit of one pulse; None if it slid for too few messages."""
    slides = _sliding(speed, floor)
    if slides.stop - slides.start < thresholds.FEWEST:
        return None
    time, impulse, speed = time[slides] - time[slides.start], impulse[slides], speed[slides]
    way = np.concatenate([[0.0], np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2)])
    columns = np.stack([impulse, time, np.ones_like(time), -way], axis=-1)
    found, *_ = np.linalg.lstsq(columns, speed, rcond=None)
    if found[3] < 0:  # friction cannot fall with speed for long
        columns = columns[:, :3]
        found, *_ = np.linalg.lstsq(columns, speed, rcond=None)
    misfit = float(np.sum((columns @ found - speed) ** 2) / np.sum(speed**2))
    drag = float(found[3]) if len(found) > 3 else 0.0
    return Fit(float(found[0]), float(found[1]), drag, misfit)


def _sliding(speed: Array, floor: float) -> slice:
    """Messages around the highest speed in which it surely slides, in one direction."""
    if not len(speed) or np.abs(speed).max() < floor:
        return slice(0, 0)
    peak = int(np.argmax(np.abs(speed)))
    rests = speed * np.sign(speed[peak]) < max(thresholds.MOVING * abs(speed[peak]), floor)
    before, after = np.flatnonzero(rests[:peak]), np.flatnonzero(rests[peak:])
    begin = int(before[-1]) + 1 if len(before) else 0
    return slice(begin, peak + int(after[0]) if len(after) else len(speed))


def response_of(seen: Evidence) -> Response | None:
    """Response to the pulses of the trial; None without any. Many checks ask: it is kept."""
    if seen.trial is None or not seen.trial.pulses:
        return None
    kept = vars(seen)
    if "response" not in kept:
        kept["response"] = respond(seen.motion, seen.trial, seen.climber)
    return kept["response"]


def _cosine(a: Array, b: Array) -> float:
    """Cosine similarity of two vectors (n,)."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size else 0.0


def pushed_on(motion: MotionSeen, silence: tuple[int, int]) -> tuple[float, float, float]:
    """Yaw rate [rad/s] at the begin of a silence [ns]; yaw rate and acceleration at its end."""
    begin, end = silence
    last = (motion.stamp > end - (end - begin) // 3) & (motion.stamp <= end)
    slope, _ = np.polyfit(motion.time[last], motion.twist[last, 2], 1)
    before = float(np.interp(begin, motion.stamp, motion.twist[:, 2]))
    return before, float(np.mean(motion.twist[last, 2])), float(slope)
