"""When the controller follows, and when it gives its safe output instead: a small state machine.

Its state is a `Mode`; `Controller` asks after every odometry, reference and look at the clock which
one it is now.
"""

import math
from collections import deque
from enum import Enum

from climber_uk.control.timing import LONGEST_STEP
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Motion
from climber_uk.parameters.declaration import parameter, parameters

SPEED_TIME = 0.1  # [s] in which a jump of the speed would become one of the place


class Mode(Enum):
    """What the controller does; the value is its text in log and diagnostics."""

    FOLLOWING = "following"
    WAITING = "waiting for a reference"  # the only one without any output: a simulation waits
    NOT_BEGUN = "the reference begins later"
    DISABLED = "disabled"
    NO_CLOCK = "use_sim_time is true, but there is no clock"
    NO_ODOMETRY = "no odometry"
    BAD_ODOMETRY = "bad odometry"
    SELDOM = "odometry comes too seldom"
    JUMPED = "odometry jumped"
    NO_TWIST = "the pose moves while the twist is zero"
    LOW_PRESSURE = "suction pressure too low"
    EMERGENCY_STOP = "emergency stop"
    LOW_BATTERY = "battery low"
    TETHER = "tether at its end"
    NO_REFERENCE = "no reference"
    NO_SOLUTION = "no torque can be computed"
    TWIST_WRONG = "twist and pose contradict each other"
    HEADING_WRONG = "the pose goes another way than it heads"
    SIGN_WRONG = "twist and pose have opposite signs"
    WHEELS_DIFFER = "the wheels turn otherwise than odometry says"
    TOO_FAR = "too far from the reference"
    OFF_PATH = "off the path"
    APPROACHING = "approaching the reference"
    TOO_FAST = "faster than the reference allows"
    STALLED = "torque at its limit without effect"
    DISTURBED = "a disturbance that nothing explains"
    DEAD_WHEEL = "a wheel does not answer its torque"
    LATE = "odometry is older than its stamps say"

    @property
    def is_fault(self) -> bool:
        """Whether it is an error, not something that was asked for."""
        return self not in NO_FAULTS

    @property
    def doubts_odometry(self) -> bool:
        """Whether speeds of odometry may be wrong, so that braking by them may drive."""
        return self in (
            Mode.JUMPED,
            Mode.NO_TWIST,
            Mode.TWIST_WRONG,
            Mode.HEADING_WRONG,
            Mode.SIGN_WRONG,
            Mode.WHEELS_DIFFER,
        )


Trouble = tuple[Mode, str]  # and a detail of it
NO_FAULTS = frozenset(
    {Mode.FOLLOWING, Mode.APPROACHING, Mode.WAITING, Mode.NOT_BEGUN, Mode.DISABLED}
)


FLAPPING = 3  # faults within `FLAPPING_TIME`, after which the next one has to be over for a while
FLAPPING_TIME = 2 * SECOND  # [ns]
CALM = SECOND // 2  # [ns] for which it has to be over


class Calm:
    """Faults that come and go: the last one has to be over for a while."""

    def __init__(self) -> None:
        self._last: tuple[int, Trouble] | None = None  # [ns] when it was there last
        self._times: deque[int] = deque(maxlen=FLAPPING)  # [ns] when each began

    def mode(self, before: Mode, time: int, current: Trouble) -> Trouble:
        """`current` trouble at `time` [ns], after a mode `before`; or the last fault instead."""
        mode, _ = current
        if mode.is_fault:
            if not before.is_fault:
                self._times.append(time)
            self._last = time, current
        elif before.is_fault and self._last is not None and mode is Mode.FOLLOWING:
            over_since, fault = self._last
            if (
                len(self._times) == FLAPPING
                and 0 <= over_since - self._times[0] < FLAPPING_TIME
                and 0 <= time - over_since < CALM
            ):
                return fault
        return current


@parameters
class Safety:
    """What is too old or too far, and what is done then."""

    safe_output: str = parameter(
        "zero",
        "",
        "torques while the reference is not followed: none (zero), or weight held and motion "
        "braked (hold)",
        choices=("zero", "hold"),
    )
    braking_rate: float = parameter(
        5.0, "1/s", "rate at which the safe output 'hold' brakes", at_least=0
    )
    odometry_timeout: float = parameter(
        0.1,
        "s",
        "age at which odometry is stale; a silence of 0.3 s, or three periods, is too long anyhow",
        above=0,
        plausible=(0.002, 5),
    )
    reference_timeout: float = parameter(
        0.1, "s", "how long a reference is waited for", above=0, plausible=(0.002, 5)
    )
    least_pressure: float = parameter(
        0.0,
        "Pa",
        "suction below which the climber is stopped; 0: never",
        at_least=0,
        plausible=(100, 1e5),
    )
    max_jump: float = parameter(
        0.2,
        "m",
        "distance by which a wheel may be elsewhere than the model expects",
        above=0,
        plausible=(0.005, 5),
    )
    settling_messages: int = parameter(
        5, "", "odometry messages without a jump until the reference is followed again", at_least=1
    )

    max_twist_error: float = parameter(
        0.05,
        "m",
        "distance by which the way in half a second may differ between twist and pose, beside 30 %",
        above=0,
    )

    @property
    def shortest(self) -> float:
        """Time [s], the shortest after which silence of something is to be noticed."""
        return min(self.odometry_timeout, self.reference_timeout, LONGEST_STEP)

    def has_jumped(self, expected: Motion, measured: Motion, half_track: float) -> bool:
        """Whether a wheel is, or will soon be, further than `max_jump` from where expected."""
        heading_change = wrapped(measured.heading - expected.heading)
        gone = math.hypot(measured.x - expected.x, measured.y - expected.y)
        gone += half_track * abs(heading_change)
        going = half_track * abs(measured.yaw_rate - expected.yaw_rate) + math.hypot(
            measured.speed * measured.cosine - expected.speed * expected.cosine,
            measured.speed * measured.sine - expected.speed * expected.sine,
        )
        return not max(gone, going * SPEED_TIME) <= self.max_jump
