"""Where a climber is and what disturbs it: from odometry, and from the torques that act meanwhile.

One climber, or many in step: arrays (N,) where there are floats. Stamps are integers in
nanoseconds, on the clock of the odometry.
"""

from typing import Any, NamedTuple

from climber_uk.control.control_law import ControlInput
from climber_uk.control.delay_check import DelayCheck
from climber_uk.control.model import (
    EXPECTED_REST,
    REST,
    SETTLES,
    SLOW,
    SLOW_TURN,
    DisturbanceEstimate,
    Observer,
    Shares,
    predict,
)
from climber_uk.control.observed import Acting, Observed
from climber_uk.control.safety import Safety
from climber_uk.control.side_slip import NO_SLIP, shown
from climber_uk.control.timing import (
    LONGEST_DELAY,
    LONGEST_STEP,
    Latency,
    Sample,
    Timing,
    TorqueHistory,
)
from climber_uk.control.twist import TwistKind, mean_twist
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import anywhere, clipped, select, sign, tanh
from climber_uk.mechanics.many import chosen
from climber_uk.mechanics.quantities import Motion, Torques, Wrench
from climber_uk.mechanics.wall import Wall, weight_beyond

LONG_AGO = round(2 * LONGEST_STEP * SECOND)  # [ns]
KEPT_LONGER = round(LONGEST_DELAY * SECOND)  # [ns] torques are kept, as a delay may yet show
PERIOD_SMOOTHING = 0.1  # share of a new period in the mean


class Memory(NamedTuple):
    """What an `Estimator` has of before, in numbers: of one climber, or of each of many."""

    motion: Motion
    learnt: DisturbanceEstimate
    direction: Any  # of the reference
    turn: Any
    learning: Any
    torques: tuple[Torques, ...]  # those that act, and those on their way


class Estimator:
    """Predicts the climber's motion by its model, and corrects it by odometry.

    In turn: `see` takes an odometry, `ahead` gives the motion with which its answer will begin to
    act, and `sent` takes that answer. Odometry further off than `safety` allows is a jump: the
    estimate starts anew from there.
    """

    def __init__(
        self,
        climber: Climber,
        observer: Observer,
        timing: Timing,
        safety: Safety | None = None,
        wall: Wall | None = None,
    ) -> None:
        self.climber, self.observer, self.timing, self.safety = climber, observer, timing, safety
        self.wall = wall  # None: a plane that is not tilted
        self.period = timing.control_period  # [s] from one odometry to the next
        self._period_is_measured = False
        self._sent = TorqueHistory()
        self.latency, self.twist, self.delays = Latency(), TwistKind(), DelayCheck()
        self.checks_delay = True  # at once: what is sent is what is to act
        self._delay = 0.0  # [s] of the last answer
        self._kept = 0  # [ns] for which torques are kept that have acted, as far as is known
        self.reset()

    def reset(self) -> None:
        """Start anew, from an unknown state at an unknown time."""
        self.restart()
        self.forget()

    def restart(self) -> None:
        """Go on at an unknown time, from an unknown state: the clock was set back."""
        self.stamp = 0  # [ns]
        self._sent.restart()
        self.delays.restart()
        self.motion: Motion | None = None
        self._last_odometry: Motion | None = None  # as it came

    def forget(self) -> None:
        """Forget what was learnt of the disturbance."""
        self.learnt, self.slip = DisturbanceEstimate(), NO_SLIP
        self._direction = 0.0  # of the reference: 1 forwards, -1 backwards, 0 at rest
        self._turning: Any = 0.0  # [rad/s] as wanted
        self._turn: Any = 0.0  # of the same: 1 to the left, -1 to the right, 0 hardly
        # whether no limit cut the last answer, so that errors are due to the disturbance:
        # a bool; of many climbers an array (N,) of them
        self._learning: Any = False

    def go_over_to(self, climber: Climber) -> None:
        """Have another model; friction that was learnt takes no more away than its seal has."""
        self.climber, f = climber, climber.seal_friction
        friction = clipped(self.learnt.friction + 0.0 * f, -f, f)
        self.learnt = self.learnt._replace(friction=friction)

    @property
    def memory(self) -> tuple[Memory, tuple[Any, ...]]:
        """What it has of before: numbers, and the times of all, without the clock."""
        assert self.motion is not None
        begun, torques = zip(*self._sent.begun, strict=True)
        ways = self._direction, self._turn
        numbers = Memory(self.motion, self.learnt, *ways, self._learning, torques)
        return numbers, (self.period, self._delay, *(begins - self.stamp for begins in begun))

    def remember(self, memory: Memory, times: tuple[Any, ...], stamp: int) -> None:
        """Go on from the `memory` of another one, as if its last stamp [ns] had been `stamp`."""
        self.motion, self.learnt, self._direction, self._turn, self._learning, torques = memory
        self.period, self._delay, *begun = times
        self._period_is_measured, self.stamp, self._sent = True, stamp, TorqueHistory()
        for begins, each in zip(begun, torques, strict=True):
            self._sent.add(stamp + begins, each)

    @property
    def disturbance(self) -> Wrench:
        """Force [N] along the climber and moment [N m] beside the model's, friction included."""
        learnt = self.learnt
        moment = learnt.moment - self._turn * learnt.turning
        return Wrench(learnt.force - self._direction * learnt.friction, moment)

    def see(self, stamp: int, motion: Motion, aside: float = 0.0) -> Observed | None:
        """Correct state and disturbance by an odometry of `stamp` [ns], newer than the last.

        `aside` is the speed [m/s] to the left that it tells, which counts only where it is to.
        Returns what it tells of the time since the last; None for the first, and after a jump.
        """
        before, has_twist = self.motion, self.observer.velocity_source == "odometry"
        if before is not None:
            acted = self._acting(self.stamp, stamp)
            expected = self._predicted(before, acted)
            if not has_twist:
                motion = motion._replace(speed=expected.speed, yaw_rate=expected.yaw_rate)
            safety = self.safety
            if safety is None or not safety.has_jumped(expected, motion, self.climber.half_track):
                return self._correct(stamp, before, acted, expected, motion, aside)
            self.reset()
        self.stamp = stamp
        self.motion = motion if has_twist else motion._replace(speed=0.0, yaw_rate=0.0)
        return None

    def ahead(self, age: float) -> ControlInput:
        """Situation when an answer to the last odometry, given at its `age` [s], begins to act."""
        begins, learnt = self.begin(age), self.learnt
        motion, disturbance = self.expected_at(begins), Wrench(learnt.force, learnt.moment)
        held, resistance = self._sent.last, (learnt.friction, learnt.turning)
        return ControlInput(
            *(motion, held, disturbance, self.period, begins, *resistance),
            aside=self._aside(motion),
            stiction=tanh(learnt.stiction),
        )

    def pending(self, begins: int) -> Acting:
        """Torques that act from the last odometry until `begins` [ns]."""
        return self._acting(self.stamp, begins)

    @property
    def _known(self) -> float:
        """How much later than they arrive torques act, as far as is known [s]."""
        timing = self.timing
        return timing.transport_delay + (self.latency.delay if timing.learn_delay else 0.0)

    def acts_later(self, by: float) -> bool:
        """Learn that torques act later than is known `by` some time [s]; False if it may not be."""
        delay = self._known + by - self.timing.transport_delay
        return self.timing.learn_delay and self.latency.takes(delay)

    def _acting(self, start: int, end: int) -> Acting:
        """Torques that act from `start` to `end` [ns]."""
        later = round(self._known * SECOND)
        return self._sent.between(start - later, end - later)

    def begin(self, age: float) -> int:
        """When an answer to the last odometry, given at its `age` [s], begins to act [ns]."""
        age = age if self.timing.measure_delay else 0.0
        self._delay = self._known + age
        begins = self._sent.begin(self.stamp + round(age * SECOND))
        return begins + round(self._known * SECOND)

    def sent(
        self,
        begins: int,
        torques: Torques,
        learning: Any = False,
        speed: Any | None = None,
        yaw_rate: Any = 0.0,
        forward: Any = 0.0,
    ) -> None:
        """Torques were sent, which act from `begins` [ns] on, to drive at a `speed` [m/s].

        The `yaw_rate` [rad/s] and the acceleration `forward` [m/s²] are those that are wanted.

        `learning` is whether they are what was wanted: where a limit cut them, nothing is
        learnt of the disturbance.
        """
        self._learning = learning
        if speed is not None:
            self._direction = sign(select(abs(speed) > SLOW, speed, 0.0))
            assert self.motion is not None  # it was answered
            held = (abs(speed) < REST) & (abs(self.motion.speed) < EXPECTED_REST)
            if anywhere(held | (self.learnt.stiction != 0.0)):
                self.learnt = self.learnt.asked(forward, held, self.period)
            self._turning = yaw_rate
            self._turn = sign(select(abs(yaw_rate) > SLOW_TURN, yaw_rate, 0.0))
        later = round(self._known * SECOND)
        self._sent.add(begins - later, torques)
        # without odometry, too, that of long ago is not needed
        self._sent.forget_before(max(self.stamp, begins - LONG_AGO) - later - self._kept)

    def correct(self, torques: Torques) -> None:
        """Have `torques` in the place of those that were sent last."""
        self._sent.correct(torques)

    def expected_at(self, stamp: int) -> Motion:
        """Motion at `stamp` [ns] as the model rolls on from the last odometry."""
        assert self.motion is not None
        if stamp == self.stamp:
            return self.motion
        return self._predicted(self.motion, self._acting(self.stamp, stamp))

    def _aside(self, motion: Motion) -> float:
        """Speed [m/s] at which wheels give way to the left."""
        slip = self.slip
        return slip.speed(self.climber, motion, self.wall) if slip is not NO_SLIP else 0.0

    def _predicted(self, motion: Motion, acting: Acting) -> Motion:
        """Motion after torques have acted, each for some time [s]."""
        climber, learnt = self.climber, self.learnt
        r_F, r_N, resisting = learnt.force, learnt.moment, (learnt.friction, learnt.turning)
        wall, aside = self.wall, self._aside(motion)
        for torques, time in acting:
            force, moment = climber.wrench(*torques)
            if wall is not None:
                force = force + weight_beyond(wall, climber, motion, time)[0]
            motion = predict(climber, motion, force + r_F, moment + r_N, time, *resisting, aside)
        return motion

    def _correct(
        self,
        stamp: int,
        before: Motion,
        acted: Acting,
        expected: Motion,
        motion: Motion,
        aside: float,
    ) -> Observed:
        """Correct what is `expected` at `stamp` [ns] by the `motion` that odometry gives."""
        time = (stamp - self.stamp) / SECOND
        last, self._last_odometry = self._last_odometry, motion
        reaction = self._delay + self.period / 2
        pull = 0.0 if self.wall is None else weight_beyond(self.wall, self.climber, motion)[0]
        observed = Observed(
            before, motion, time, acted, self.disturbance, reaction, pull, self._turning
        )
        # speeds that come from poses share their noise, which would be learnt
        has_twist = self.observer.velocity_source == "odometry" and isinstance(motion.x, float)
        share = PERIOD_SMOOTHING if self._period_is_measured else 1.0
        self.period += share * (time - self.period)
        self._period_is_measured = True
        is_known = self._sent.are_known_since(self.stamp - round(self._known * SECOND))
        shares = self.observer.shares(time, self._delay)
        left = clipped(self.learnt.settling - time, 0.0, SETTLES)
        settling = select(abs(motion.speed) > SLOW, left, SETTLES)
        self.learnt = self.learnt._replace(settling=settling)
        if has_twist:
            if last is not None:
                self._learn_slip(last, motion, aside, time)
            motion = self._at_its_stamp(last, before, expected, motion, time)
            if is_known:
                self._kept = KEPT_LONGER
                if self.timing.learn_delay:
                    self._learn_delay(acted[-1][0], expected, motion, time, shares)
                if self.checks_delay:
                    observed = self._check_delay(observed, stamp)
        self.motion, learnt = self.observer.corrected(
            self.climber, self.learnt, expected, motion, time, shares, self._direction, self._turn
        )
        self.stamp = stamp
        if is_known:
            if self._learning is not True:  # of many, each learns or keeps what it has learnt
                learnt = chosen(self._learning, learnt, self.learnt.without_rates)
            self.learnt = learnt
        return observed

    def _learn_slip(self, last: Motion, motion: Motion, aside: float, time: float) -> None:
        """Learn how wheels give way, of poses `time` [s] apart, or a speed `aside` [m/s] told."""
        observer, bandwidth = self.observer, self.observer.side_slip_bandwidth
        if bandwidth == 0:
            return
        if observer.side_slip_source == "pose":
            aside = shown(last, motion, time)
        self.slip = self.slip.learnt(self.climber, motion, aside, time, bandwidth, self.wall)

    def _at_its_stamp(
        self, last: Motion | None, before: Motion, expected: Motion, now: Motion, time: float
    ) -> Motion:
        """Motion whose speeds are those of its stamp, not the mean of the `time` [s] before."""
        kind = self.observer.twist
        if kind == "auto" and last is not None:
            self.twist.learn(last, now, time)
        if kind == "instantaneous" or (kind == "auto" and not self.twist.is_mean):
            return now
        speed, rate = mean_twist(before, expected, time)
        return now._replace(
            speed=now.speed + expected.speed - speed,
            yaw_rate=now.yaw_rate + expected.yaw_rate - rate,
        )

    def _learn_delay(
        self, acting: Torques, expected: Motion, measured: Motion, time: float, shares: Shares
    ) -> None:
        """Learn how much later than configured torques act; `shares` are the observer's."""
        climber = self.climber
        force, moment = climber.wrench(*acting)
        lever = climber.half_track
        accelerations = force / climber.driven_mass, lever * moment / climber.driven_inertia
        errors = measured.speed - expected.speed, lever * (measured.yaw_rate - expected.yaw_rate)
        sample = Sample(accelerations, errors, time, abs(measured.speed) > SLOW)
        self.latency.learn(sample, shares, self.timing.transport_delay)

    def _check_delay(self, observed: Observed, stamp: int) -> Observed:
        """Learn the delay at once where it is quite another; what is observed, if it may not be."""
        arrived = observed._replace(acted=self._sent.between(self.stamp, stamp))
        delay = self.delays.add(self.climber, arrived, self._known)
        if delay is None or self.acts_later(delay - self._known):
            return observed
        return observed._replace(late=delay - self._known)
