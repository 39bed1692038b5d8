"""Checks of how a driver takes torques, from a trial of small pulses."""

import math

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence
from climber_uk.driver_check.moving import ratio
from climber_uk.driver_check.pulses import PUSHED_BY
from climber_uk.driver_check.report import Finding, failed, graded, passed, skipped, warned
from climber_uk.driver_check.response import Response, pushed_on, response_of

NOT_MOVED = skipped("only with --move")


def trial(seen: Evidence) -> Finding:
    """The trial was completed."""
    if seen.trial is None:
        return NOT_MOVED
    if seen.trial.trouble:
        return failed(f"stopped: {seen.trial.trouble}", seen.trial.hint)
    if seen.trial.takes_speeds:
        return passed("steps of speed, and back")
    return passed(f"torques up to {_peak(seen):.2f} N m, of {seen.trial.highest:.2f} allowed")


def motors(seen: Evidence) -> Finding:
    """The driver obeys that part of the command that the controller is told it does."""
    response = response_of(seen)
    if response is None or seen.trial is None or not np.isfinite(response.gains).any():
        return NOT_MOVED if seen.trial is None else skipped("it obeys neither")
    found = "velocity" if seen.trial.takes_speeds else "torque"
    what = {"velocity": "takes speeds (velocity)", "torque": "takes torques (effort)"}[found]
    if found != seen.expected.motors:
        hint = f"set the controller's motors to {found}, or the board to the other"
        return failed(f"{what}; motors says {seen.expected.motors}", hint)
    return passed(what)


def servo(seen: Evidence) -> Finding:
    """The time constant of a board that takes speeds is the one that the controller is told."""
    response = response_of(seen)
    if response is None or seen.trial is None:
        return NOT_MOVED
    if not seen.trial.takes_speeds:
        return skipped("of boards that take speeds")
    found, told = response.time_constant, seen.expected.servo_time_constant
    said = f"63 % of a step in {1e3 * found:.0f} ms; servo_time_constant says {1e3 * told:.0f} ms"
    is_near = abs(found - told) < thresholds.SERVO_NEAR
    off = 1.0 if is_near else max(found / told, told / found) if told > 0 else math.inf
    hint = f"set the controller's servo_time_constant to {found:.3f}"
    bounds = thresholds.SERVO_OFF, math.inf
    return graded(off, bounds, said, hint, time_constant=found)


def turning(seen: Evidence) -> Finding:
    """What resists turning, and the half track that wheels show: of wheels that scrub."""
    response = response_of(seen)
    if response is None or seen.trial is None:
        return NOT_MOVED
    said, values = list[str](), dict[str, float]()
    if math.isfinite(response.turning_friction):
        friction, drag = response.turning_friction, response.turning_resistance
        said.append(f"resisted by {friction:.2f} N m and {drag:.2f} N m s")
        values |= {"turning_friction": friction, "turning_resistance": drag}
    half_track, off = _effective_half_track(seen, response), 1.0
    if math.isfinite(half_track):
        said.append(f"wheels show a half track of {half_track:.3f} m")
        values["effective_half_track"] = half_track
        off = max(half_track / seen.climber.half_track, seen.climber.half_track / half_track)
    if not said:
        return skipped("neither torques nor the rates of wheels tell")
    hint = "see half_track; for odometry of wheels that scrub, set effective_half_track"
    return graded(off, (thresholds.TRACK_OFF, math.inf), "; ".join(said), hint, **values)


def _effective_half_track(seen: Evidence, response: Response) -> float:
    """Half track [m] by the wheels' rates and the yaw rate; nan if nothing tells."""
    if seen.trial is not None and seen.trial.takes_speeds:
        drive, yaw = np.diag(response.gains).tolist()
        return seen.climber.half_track * drive / yaw if yaw > 0 else math.nan
    motion, told = seen.motion, sorted(seen.turning)
    if len(told) < thresholds.FEWEST:
        return math.nan
    stamps, right, left = np.array(told, float).T
    rims = seen.climber.wheel_radius * (right - left) / 2
    yaw = np.interp(stamps, motion.stamp.astype(float), motion.twist[:, 2])
    clear = np.abs(yaw) > thresholds.MOVING * np.abs(yaw).max(initial=0.0)
    clear &= np.abs(yaw) > thresholds.STANDING_RATE
    return ratio(rims[clear], yaw[clear]) if clear.sum() >= thresholds.FEWEST else math.nan


def wheels(seen: Evidence) -> Finding:
    """Each torque acts on its wheel, with its sign."""
    response = response_of(seen)
    if response is None:
        return NOT_MOVED
    if not np.isfinite(response.gains).any():
        hint = "are the motors on? If more friction is to be overcome, raise torque_share"
        return failed(f"no reaction to speeds, nor to torques up to {_peak(seen):.2f} N m", hint)
    wiring, likeness = response.wiring
    if likeness < thresholds.LIKENESS:
        gains = np.array2string(response.gains, precision=2).replace("\n", "")
        hint = "do both motors obey the same part of the command?"
        return failed(f"no wiring explains it: gains {gains}", hint)
    if wiring:
        return failed(wiring, "commands go by the names in `name`; positive drives forward")
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
    if seen.trial is not None and seen.trial.takes_speeds:
        off = max(drive, 1 / drive) if drive > 0 else math.inf
        hint = "see wheel_radius, here and in the driver, and its counts a turn"
        bounds = thresholds.GAIN_OFF, thresholds.GAIN_WRONG
        said = f"drives {drive:.2f} times, turns {yaw:.2f} times as fast as it is told"
        return graded(off, bounds, said, hint, drive=drive, turn=yaw)
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
    said = f"{1e3 * response.delay:.1f} ms from a command to its acceleration"
    said += f"; transport_delay says {1e3 * configured:.1f} ms" if configured else ""
    hint = f"set the controller's transport_delay to {response.delay:.3f}"
    by_speeds = seen.trial is not None and seen.trial.takes_speeds
    soon = thresholds.SERVO_REACTION if by_speeds else thresholds.REACTION
    bounds = soon, thresholds.LATE_REACTION
    return graded(abs(response.delay - configured), bounds, said, hint, delay=response.delay)


def watchdog(seen: Evidence) -> Finding:
    """The driver's watchdog: a torque ends when no other comes."""
    if seen.trial is None:
        return NOT_MOVED
    if seen.trial.silence is None:
        return skipped("not tried" + (": simulated time waits for torques" * seen.use_sim_time))
    begin, end = seen.trial.silence
    rate, last, acceleration = pushed_on(seen.motion, (begin, end))
    if rate < thresholds.STANDING_RATE / 2:
        return skipped(f"the command was too small to turn it ({rate:.3f} rad/s)")
    if seen.trial.takes_speeds:
        said = f"{last:.3f} rad/s at the end of {(end - begin) * 1e-9:.2f} s without a command"
        if abs(last) > thresholds.STILL_PUSHED * rate:
            hint = "the motor board must set speeds to zero by itself, 0.1 s after the last command"
            return failed(f"still turns: {said}", hint, yaw_rate=last)
        return passed(f"stands: {said}", yaw_rate=last)
    said = f"{acceleration:.3f} rad/s² at the end of {(end - begin) * 1e-9:.2f} s without a command"
    if acceleration > thresholds.STILL_PUSHED * PUSHED_BY:
        hint = "the motor board must set torques to zero by itself, 0.1 s after the last command"
        return failed(f"still pushes: {said}", hint, acceleration=acceleration)
    return passed(f"pushes no more: {said}", acceleration=acceleration)


def _peak(seen: Evidence) -> float:
    """Highest torque of a wheel in the trial [N m]."""
    assert seen.trial is not None
    return max((float(np.abs(c.torques).max()) for c in seen.trial.commands), default=0.0)
