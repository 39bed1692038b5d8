"""Checks of how a driver takes torques, from a trial of small pulses."""

import math

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence
from climber_uk.driver_check.pulses import PUSHED_BY
from climber_uk.driver_check.report import Finding, failed, graded, passed, skipped, warned
from climber_uk.driver_check.response import pushed_on, response_of

NOT_MOVED = skipped("only with --move")


def trial(seen: Evidence) -> Finding:
    """The trial was completed."""
    if seen.trial is None:
        return NOT_MOVED
    if seen.trial.trouble:
        hint = "stop it, hold it, stop all that commands it besides, and try again"
        return failed(f"stopped: {seen.trial.trouble}", hint)
    return passed(f"torques up to {_peak(seen):.2f} N m, of {seen.trial.highest:.2f} allowed")


def wheels(seen: Evidence) -> Finding:
    """Each torque acts on its wheel, with its sign."""
    response = response_of(seen)
    if response is None:
        return NOT_MOVED
    if not np.isfinite(response.gains).any():
        hint = "are the motors on? If more friction is to be overcome, raise torque_share"
        return failed(f"no reaction to torques up to {_peak(seen):.2f} N m", hint)
    wiring, likeness = response.wiring
    if likeness < thresholds.LIKENESS:
        gains = np.array2string(response.gains, precision=2).replace("\n", "")
        hint = "are both motors driven by torque (current), and not by speed?"
        return failed(f"no wiring explains it: gains {gains}", hint)
    if wiring:
        return failed(wiring, "effort goes by the names in `name`; positive drives forward")
    if np.isnan(response.gains[0, 0]):
        hint = "more friction is to be overcome than the parameters say: raise torque_share"
        return warned(f"turns rightly, but did not drive with {_peak(seen):.2f} N m", hint)
    return passed("right and left are right, and positive is forward")


def gain(seen: Evidence) -> Finding:
    """Accelerations are those of mass, yaw inertia, wheel radius and half track."""
    response = response_of(seen)
    if response is None:
        return NOT_MOVED
    drive, yaw = np.diag(response.gains).tolist()
    off_drive, off_yaw = (max(g, 1 / g) if math.isfinite(g) else 1.0 for g in (drive, yaw))
    if max(drive / yaw, yaw / drive) < thresholds.GAIN_OFF:
        hint = "see wheel_radius, here and in the driver, and its N m per ampere"
    else:
        hint = "see mass" if off_drive > off_yaw else "see yaw_inertia and half_track"
    said = f"drives {drive:.2f} times, turns {yaw:.2f} times as fast as the parameters say"
    bounds = thresholds.GAIN_OFF, thresholds.GAIN_WRONG
    return graded(max(off_drive, off_yaw), bounds, said, hint, drive=drive, turn=yaw)


def latency(seen: Evidence) -> Finding:
    """A torque acts as late as `transport_delay` has it."""
    response = response_of(seen)
    if response is None:
        return NOT_MOVED
    configured = seen.expected.transport_delay
    said = f"{1e3 * response.delay:.1f} ms from a torque to its acceleration"
    said += f"; transport_delay says {1e3 * configured:.1f} ms" if configured else ""
    hint = f"set the controller's transport_delay to {response.delay:.3f}"
    bounds = thresholds.REACTION, thresholds.LATE_REACTION
    return graded(abs(response.delay - configured), bounds, said, hint, delay=response.delay)


def watchdog(seen: Evidence) -> Finding:
    """The driver's watchdog: a torque ends when no other comes."""
    if seen.trial is None:
        return NOT_MOVED
    if seen.trial.silence is None:
        return skipped("not tried" + (": simulated time waits for torques" * seen.use_sim_time))
    begin, end = seen.trial.silence
    rate, acceleration = pushed_on(seen.motion, (begin, end))
    if rate < thresholds.STANDING_RATE / 2:
        return skipped(f"the torque was too small to turn it ({rate:.3f} rad/s)")
    said = f"{acceleration:.3f} rad/s² at the end of {(end - begin) * 1e-9:.2f} s without a command"
    if acceleration > thresholds.STILL_PUSHED * PUSHED_BY:
        hint = "the motor board must set torques to zero by itself, 0.1 s after the last command"
        return failed(f"still pushes: {said}", hint, acceleration=acceleration)
    return passed(f"pushes no more: {said}", acceleration=acceleration)


def _peak(seen: Evidence) -> float:
    """Highest torque of a wheel in the trial [N m]."""
    assert seen.trial is not None
    return max((float(np.abs(c.torques).max()) for c in seen.trial.commands), default=0.0)
