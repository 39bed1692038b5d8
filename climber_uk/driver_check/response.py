"""Response of a climber to torques, fitted to pulses of the pairs τR = ±τL.

    speed(t) = speed₀ + G ∫ τ(t - L) dt + c t - κ ∫ speed dt

while it slides in one direction: c and κ stand for friction and weight. By (11) and (15)
G = 2/(r m) for the drive and 2 d/(r J) for the turn. A speed that is the mean of the period before
its stamp, as of encoders, is that of the period's middle.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence, MotionSeen, TrialRecord
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber

PAIR = np.array([[1.0, 1.0], [1.0, -1.0]])  # (right, left), to drive and to yaw
COARSE = 20  # delays that are tried, and again so many around the best
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
    return np.array([force / climber.mass, moment / climber.yaw_inertia])


@dataclass(frozen=True)
class Fit:
    """Fit of one speed in one pulse."""

    gain: float  # per torque of each wheel of the pair
    offset: float  # c
    misfit: float  # sum of squares, by that of the speed


@dataclass(frozen=True)
class Response:
    """Gains of the pairs of torques, by those of the model; nan where it did not move."""

    gains: Array  # (2, 2): driving, yawing pair (rows) on forward speed, yaw rate (columns)
    offsets: Array  # (2, 2) c
    delay: float  # L [s]

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
    return Response(gains / expected_gain(climber), offsets, float(best))


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
    return Fit(float(found[0]), float(found[1]), misfit)


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
    """Response to the pulses of the trial; None without any."""
    if seen.trial is None or not seen.trial.pulses:
        return None
    return respond(seen.motion, seen.trial, seen.climber)


def _cosine(a: Array, b: Array) -> float:
    """Cosine similarity of two vectors (n,)."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size else 0.0


def pushed_on(motion: MotionSeen, silence: tuple[int, int]) -> tuple[float, float]:
    """Yaw rate [rad/s] at the begin of a silence [ns], and yaw acceleration [rad/s²] at its end."""
    begin, end = silence
    last = (motion.stamp > end - (end - begin) // 3) & (motion.stamp <= end)
    slope, _ = np.polyfit(motion.time[last], motion.twist[last, 2], 1)
    return float(np.interp(begin, motion.stamp, motion.twist[:, 2])), float(slope)
