"""The checks, in their order; a new one is a function and an entry here."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from climber_uk.driver_check import listening, moving, reacting, sensing, timing
from climber_uk.driver_check.evidence import Evidence
from climber_uk.driver_check.report import Finding, Report, Verdict, skipped


class Check(NamedTuple):
    """A check, which is skipped if one of those that it comes `after` has failed."""

    look: Callable[[Evidence], Finding]
    after: tuple[str, ...] = ()


COMES = ("topic",)
GOOD = ("topic", "rate", "order", "finite")  # numbers to compute with
SAFE = (*GOOD, "publishers", "commands", "clock", "age")  # to move at all
MOVED = (*SAFE, "heading", "twist", "trial")

CHECKS: Mapping[str, Check] = {
    "topic": Check(listening.topic),
    "publishers": Check(listening.publishers, COMES),
    "qos": Check(listening.qos, COMES),
    "commands": Check(listening.commands),
    "clock": Check(timing.clock, COMES),
    "order": Check(timing.order, (*COMES, "publishers", "clock")),
    "rate": Check(timing.rate, (*COMES, "publishers", "clock", "order")),
    "jitter": Check(timing.jitter, (*COMES, "publishers", "clock", "order", "rate")),
    "age": Check(timing.age, (*COMES, "clock", "order")),
    "frames": Check(listening.frames, COMES),
    "finite": Check(listening.finite, COMES),
    "covariance": Check(listening.covariance, COMES),
    "heading": Check(moving.heading, GOOD),
    "twist": Check(moving.twist, (*GOOD, "heading")),
    "slip": Check(moving.slip, (*GOOD, "heading", "twist")),
    "imu": Check(sensing.imu),
    "gravity": Check(sensing.gravity, (*GOOD, "imu")),
    "gyro": Check(sensing.gyro, (*GOOD, "heading", "imu", "gravity")),
    "fixes": Check(sensing.fixes, GOOD),
    "trial": Check(reacting.trial, (*SAFE, "heading", "twist")),
    "wheels": Check(reacting.wheels, MOVED),
    "motors": Check(reacting.motors, (*MOVED, "wheels")),
    "gain": Check(reacting.gain, (*MOVED, "wheels")),
    "servo": Check(reacting.servo, (*MOVED, "wheels", "motors")),
    "turning": Check(reacting.turning, (*MOVED, "wheels")),
    "latency": Check(reacting.latency, (*MOVED, "wheels")),
    "watchdog": Check(reacting.watchdog, (*MOVED, "wheels")),
}


def report(seen: Evidence) -> Report:
    """Findings of all checks, by name."""
    found: dict[str, Finding] = {}
    blocked: set[str] = set()
    for name, (look, after) in CHECKS.items():
        failed = [n for n in after if n in blocked or found[n].verdict is Verdict.FAIL]
        if failed:
            blocked.add(name)
            found[name] = skipped(f"first mend {failed[0]}")
        else:
            found[name] = look(seen)
    return found


def may_move(found: Report) -> bool:
    """Whether a trial is safe: odometry is good, and one climber alone is commanded."""
    return not any(found[name].verdict is Verdict.FAIL for name in SAFE)
