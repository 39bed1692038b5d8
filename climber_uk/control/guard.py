"""A guard beside the law: does the climber do what torques and reference can explain?

It knows the model, the torques that acted and the reference's fastest motion, and nothing of the
law. What it finds is a `Mode` in which the safe output is given.
"""

import math
from collections import deque
from typing import NamedTuple

from climber_uk.control.actuator_check import NEITHER, ActuatorCheck
from climber_uk.control.force_budget import ForceBudget
from climber_uk.control.observed import Observed
from climber_uk.control.safety import Mode, Trouble
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import Adhesion
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Motion, Torques, Wrench
from climber_uk.parameters.declaration import parameter, parameters

TOO_FAST_IN_A_ROW = 2  # odometry messages that are too fast: a single one may be wrong
MOVES = 0.02  # [m/s] from which a climber does not rest
RESTS = 1e-9  # [m/s] of a reference that does: one that begins is slow at first
AT_LIMIT = 0.98  # of the largest torque
STRONG = 0.6  # of the largest torque, which has to move a climber that stands
SWINGS = 5.0  # from one strong torque of a wheel to the opposite one, of late: a limit cycle
MEMORY = 0.4  # [s] of them, and of strong torques that move nothing
STANDS = 0.1  # of the reference's fastest motion: a climber below it stands
BREAKS_FOR = 0.15  # [s] from a torque's answer, in which friction that let go may have it faster
REACTION = 0.06  # [s] in which a torque can answer, at most
UNKNOWN_DELAY = 0.012  # [s] that torques may act later than the estimator knows
PROOF_IF_TOO_FAST = 0.4  # of that of a dead wheel is enough where it is too fast as well
RIM_REST = 0.02  # [m/s] of a wheel's rim, below which a climber rests, by its twist and its pose
FOR_GOOD = frozenset({Mode.DEAD_WHEEL, Mode.SIGN_WRONG, Mode.LATE})  # somebody has to look
STALL_REST = 10  # times the rest after which a stalled climber tries again


@parameters(slots=True)
class GuardOptions:
    """What is beyond explanation, and when the climber is trusted again; 0 switches a check off."""

    speed_margin: float = parameter(
        0.05,
        "m/s",
        "margin of the speed above the fastest that the constraints ask for on this reference",
        at_least=0,
    )
    yaw_rate_margin: float = parameter(
        1.0,
        "rad/s",
        "margin of the yaw rate above the fastest turn that the constraints ask for",
        at_least=0,
    )
    stall_time: float = parameter(
        0.12, "s", "time for which a torque at its limit may move nothing", at_least=0
    )
    max_disturbance: float = parameter(
        1.0,
        "",
        "most disturbance, as a share of what adhesion and weight could cause, as force and "
        "as moment",
        at_least=0,
    )
    response_time: float = parameter(
        0.15, "s", "time in which a wheel has to answer its torque", at_least=0
    )
    encoder_distance: float = parameter(
        0.0,
        "m",
        "distance of a wheel's rim by which `joint_states` may differ from odometry beside 30"
        " %; 0: nobody listens to them, and where odometry is stuck from the start the "
        "climber may run away",
        at_least=0,
        plausible=(0.002, 0.1),
    )
    recovery_time: float = parameter(
        0.5,
        "s",
        "time of rest after a fault, after which the reference is followed again",
        at_least=0,
    )
    attempts: int = parameter(
        3, "", "number of faults within guard.memory after which ~/enable is waited for", at_least=1
    )
    memory: float = parameter(30.0, "s", "time for which a fault counts", above=0)


UNGUARDED = GuardOptions(
    speed_margin=0.0, yaw_rate_margin=0.0, stall_time=0.0, max_disturbance=0.0, response_time=0.0
)


class Rates(NamedTuple):
    """Sizes of a speed and a yaw rate."""

    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]


class Expected(NamedTuple):
    """What a climber is to do, by its reference and constraints."""

    wanted: Rates  # of the reference
    allowed: Rates  # at most
    waits: bool  # whether the reference does, as torque is missing
    speed: float = 0.0  # [m/s] of the reference, below 0 in reverse gear
    against: float = math.inf  # [m/s] at most, the other way than that


class Swings:
    """How often a torque of late went from a strong one to the opposite."""

    def __init__(self) -> None:
        self.number, self._side = 0.0, 0.0

    def add(self, load: float, time: float) -> None:
        """Take a share (-1 to 1) of the largest torque, that acted for `time` [s]."""
        self.number *= math.exp(-time / MEMORY)
        if abs(load) < STRONG:
            return
        self.number += load * self._side < 0
        self._side = load


class Guard:
    """Watches a climber that follows."""

    def __init__(self, options: GuardOptions, adhesion: Adhesion) -> None:
        self.options, self.adhesion = options, adhesion
        self.fault: Trouble | None = None  # that was found, until the climber has rested
        self._is_stuck = False  # whether odometry stood exactly, at that fault
        self._rested = 0.0  # [s] since it is at rest
        self._rests_at: Motion | None = None
        self._followed = math.inf  # [s] since the last fault
        self.faults: deque[int] = deque()  # [ns] stamps
        self._actuators, self.budget = ActuatorCheck(), ForceBudget()
        self.restart()

    def forgive(self) -> None:
        """Forget the faults there were."""
        self.faults.clear()
        self._followed = math.inf

    def restart(self) -> None:
        """Watch from now on."""
        self._too_fast = 0
        self.late = 0.0  # [s] by which what is observed is, where it is LATE
        self._stalled = 0.0  # [s]
        self._swings = Swings(), Swings()
        self._since_rest = math.inf  # [s]
        self._actuators.restart()
        self.budget.restart()

    def watch(self, climber: Climber, observed: Observed, expected: Expected) -> Trouble | None:
        """What is wrong with what is observed; None if all is well."""
        torques = observed.torques
        self._followed += observed.time
        slower = expected.wanted.speed - climber.half_track * expected.wanted.yaw_rate
        # wheels that give way turn it otherwise than its reference does: a rim may stand by that
        turning = math.copysign(climber.half_track, expected.speed) * observed.turning
        own = expected.wanted.speed + turning, expected.wanted.speed - turning
        right, left = (min(slower, rim) for rim in own)
        self._actuators.add(climber, observed, self.options.response_time, (right, left))
        given = self._watch_budget(climber, observed, expected)
        too_fast = self._watch_rates(climber, observed, expected)
        self.late = observed.late or self.budget.late
        return (
            self._watch_delay(observed)
            or self._watch_actuators(climber, torques, PROOF_IF_TOO_FAST if too_fast else 1.0)
            or too_fast
            or self._watch_limit(climber, observed, expected, torques)
            or self._watch_swings(climber, observed, torques)
            or self._watch_disturbance(climber, observed.disturbance)
            or given
        )

    def _watch_delay(self, observed: Observed) -> Trouble | None:
        if self.options.response_time == 0 or observed.late <= 0:
            return None
        return Mode.LATE, f"by {observed.late:.2f} s, or torques act so late"

    def _watch_budget(
        self, climber: Climber, observed: Observed, expected: Expected
    ) -> Trouble | None:
        is_to_rest = expected.wanted.speed < RESTS and not expected.waits
        if self.options.stall_time == 0 or is_to_rest:
            self.budget.learn(climber, observed)  # what turns on the spot meet
            self.budget.pause()
            return None
        return self.budget.see(climber, observed, expected.wanted.speed, expected.allowed.speed)

    def _watch_rates(
        self, climber: Climber, observed: Observed, expected: Expected
    ) -> Trouble | None:
        options, motion, allowed = self.options, observed.after, expected.allowed
        is_against = motion.speed * expected.speed < 0
        lets_go = self._let_go(climber, observed)  # the way that it is driven
        most = allowed.speed + lets_go
        if is_against:
            most = min(allowed.speed, expected.against)
        fastest = most + options.speed_margin
        fastest_yaw_rate = allowed.yaw_rate + options.yaw_rate_margin
        is_fast = options.speed_margin > 0 and abs(motion.speed) > fastest
        is_yawing = options.yaw_rate_margin > 0 and abs(motion.yaw_rate) > fastest_yaw_rate
        self._too_fast = self._too_fast + 1 if is_fast or is_yawing else 0
        if self._too_fast < TOO_FAST_IN_A_ROW:
            return None
        measured, most, unit = motion.speed, fastest, "m/s"
        if not is_fast:
            measured, most, unit = motion.yaw_rate, fastest_yaw_rate, "rad/s"
        return Mode.TOO_FAST, f"{measured:.2f} {unit}, at most {most:.2f} are asked for"

    def _let_go(self, climber: Climber, observed: Observed) -> float:
        """Speed [m/s] at which friction may let go of it before a torque can answer.

        It is 0 soon after a fault: what was wrong may be so still.
        """
        before, after = observed.before.speed, observed.after.speed
        rests = abs(after) < MOVES or before * after < 0
        self._since_rest = 0.0 if rests else self._since_rest + observed.time
        answered = min(observed.reaction, REACTION) + UNKNOWN_DELAY
        if self._since_rest > BREAKS_FOR + answered or self._followed < self.options.memory:
            return 0.0
        return climber.seal_friction / climber.driven_mass * answered

    def _watch_actuators(self, climber: Climber, torques: Torques, proof: float) -> Trouble | None:
        if name := self._actuators.stuck:
            return Mode.DEAD_WHEEL, f"the {name} one stands while the other goes"
        name = self._actuators.dead(climber, proof)
        if not name:
            return None
        if name == NEITHER:
            return Mode.DEAD_WHEEL, f"neither one, at {torques[0]:.2f} and {torques[1]:.2f} N m"
        torque = torques.right if name == "right" else torques.left
        return Mode.DEAD_WHEEL, f"the {name} one, at {torque:.2f} N m"

    def _watch_limit(
        self, climber: Climber, observed: Observed, expected: Expected, torques: Torques
    ) -> Trouble | None:
        motion, wanted = observed.after, expected.wanted
        largest = max(abs(torques.right), abs(torques.left))
        load = largest / climber.max_wheel_torque
        strong, rim = STRONG, climber.half_track * wanted.yaw_rate
        if wanted.speed > max(MOVES, rim):
            is_against = motion.speed * expected.speed < 0
            stands = is_against or abs(motion.speed) < STANDS * wanted.speed
        else:  # it turns, in place or in a corner, or rests
            stands = rim > MOVES and abs(motion.yaw_rate) < STANDS * wanted.yaw_rate
            strong = AT_LIMIT  # what scrubs may resist a turn by more than the seal does a way
        effort = 0.0
        if stands and load >= strong:
            effort = load / STRONG  # it shows the sooner, the stronger it is
        elif expected.waits and load >= AT_LIMIT:
            effort = 1.0
        # one that trembles is pushed and let go in turns
        kept = 1.0 if effort else stands * math.exp(-observed.time / MEMORY)
        self._stalled = kept * self._stalled + effort * observed.time
        if not 0 < self.options.stall_time < self._stalled:
            return None
        return Mode.STALLED, f"{largest:.2f} of {climber.max_wheel_torque:.2f} N m"

    def _watch_swings(
        self, climber: Climber, observed: Observed, torques: Torques
    ) -> Trouble | None:
        for swings, torque in zip(self._swings, torques, strict=True):
            swings.add(torque / climber.max_wheel_torque, observed.time)
        if self.options.stall_time == 0 or max(it.number for it in self._swings) < SWINGS:
            return None
        return Mode.STALLED, f"to and fro, {max(map(abs, torques)):.2f} N m"

    def _watch_disturbance(self, climber: Climber, disturbance: Wrench) -> Trouble | None:
        weight, lever = climber.mass * GRAVITY, climber.half_track
        bound = self.options.max_disturbance
        force, moment = abs(disturbance.force), abs(disturbance.moment)
        if force <= bound * weight and moment <= bound * weight * lever:
            return None  # which weight alone explains
        most = bound * (self.adhesion.force(climber) + weight)
        most_moment = most * lever
        if most == 0 or (force <= most and moment <= most_moment):
            return None
        return Mode.DISTURBED, (
            f"{disturbance.force:.0f} N, {disturbance.moment:.0f} N m; "
            f"explained are {most:.0f} N, {most_moment:.0f} N m"
        )

    # Faults, and the way back

    def count(self, stamp: int, fault: Trouble) -> None:
        """Remember a fault, at `stamp` [ns]."""
        self.fault, self._rested, self._followed = fault, 0.0, 0.0
        # what a silence or a jump of odometry has `restart` forget
        self._is_stuck = self._is(Mode.STALLED) and self.budget.unanswered is not None
        self._rests_at = None
        self.faults.append(stamp)
        while stamp - self.faults[0] > self.options.memory * SECOND:
            self.faults.popleft()

    def rest(self, climber: Climber, motion: Motion, time: float) -> None:
        """A climber that had a fault is in `motion` for `time` [s]; if it has rested, trust it."""
        rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
        at, most = self._rests_at or motion, RIM_REST * self.options.recovery_time
        gone = math.hypot(motion.x - at.x, motion.y - at.y)
        gone += climber.half_track * abs(wrapped(motion.heading - at.heading))
        rests = rim < RIM_REST and gone <= most
        self._rested, self._rests_at = (self._rested + time, at) if rests else (0.0, motion)
        needed = self.options.recovery_time * (STALL_REST if self._is(Mode.STALLED) else 1)
        if self._rested > needed and not self.is_for_good:
            self.fault = None
            self.restart()
            self.budget.is_doubted = True  # what was wrong may be so still

    @property
    def is_for_good(self) -> bool:
        """Whether it ends only by ~/enable, once the climber has been looked after."""
        many = len(self.faults) >= self.options.attempts
        needs_somebody = self.fault is not None and (self._is_stuck or self.fault[0] in FOR_GOOD)
        return many or needs_somebody

    @property
    def trouble(self) -> Trouble | None:
        """The fault, and how it ends."""
        if self.fault is None:
            return None
        mode, detail = self.fault
        return mode, f"{detail}; ~/enable to go on" if self.is_for_good else detail

    def _is(self, mode: Mode) -> bool:
        return self.fault is not None and self.fault[0] is mode
