"""One climber from odometry to odometry: what acts on it, what disturbs it, and what to answer.

Stamps are integers in nanoseconds, on the clock of the odometry.
"""

import dataclasses
import math
from dataclasses import replace
from typing import Any

import numpy as np

from climber_uk.control.constraint_set import ConstraintSet
from climber_uk.control.control_law import Command, ControlInput, ControlLaw
from climber_uk.control.latency import Latency, Sample
from climber_uk.control.model import SLOW, DisturbanceEstimate, Observer, predict
from climber_uk.control.time_scaling import Pacing, Progress
from climber_uk.control.torque_history import NONE, TorqueHistory
from climber_uk.control.twist import TwistKind, mean_twist
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.many import chosen
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, Torques, Wrench
from climber_uk.parameters.declaration import parameter, parameters

LONGEST_STEP = 0.3  # [s] for which the model is trusted without an odometry
LONG_AGO = round(2 * LONGEST_STEP * SECOND)  # [ns]
PERIOD_SMOOTHING = 0.1  # share of a new period in the mean
RETUNING_TIME = 0.5  # [s] in which changed gains come to act
CUT = 1e-9  # [N, N m] of a demand that limits have taken away


@parameters(slots=True)
class Timing:
    """When a torque acts: from its arrival at the wheels to that of the next.

    It arrives `transport_delay` and the odometry's age, the clock minus its stamp, after the stamp.
    """

    control_period: float = parameter(
        0.005, "s", "from an odometry to the next, until it is measured", above=0, at_most=1
    )
    transport_delay: float = parameter(
        0.0,
        "s",
        "what the clock does not show: before the odometry's stamp and on the way to the wheels",
        at_least=0,
        at_most=LONGEST_STEP,
        runtime=True,
    )
    max_latency: float = parameter(
        0.02,
        "s",
        "age of an odometry that is believed: what is always older is the clocks' offset",
        at_least=0,
        at_most=LONGEST_STEP,
    )
    measure_delay: bool = parameter(
        True, "", "add the odometry's age to the transport delay", runtime=True
    )

    learn_delay: bool = parameter(
        True, "", "learn what is missing in the transport delay while it runs", runtime=True
    )


class SampledController:
    """Answers odometry with torques, and learns from how the climber took the last ones.

    Owned by a `Controller`, which decides whether its answers are sent; owns a `ControlLaw`, the
    state and the disturbance at the last odometry, and the history of torques. One climber, or many
    in step: arrays (N,) where there are floats.
    """

    def __init__(
        self,
        law: ControlLaw,
        observer: Observer | None = None,
        timing: Timing | None = None,
        pacing: Pacing | None = None,
    ) -> None:
        self.law, self.observer = law, observer or Observer()
        self.timing, self.pacing = timing or Timing(), pacing or Pacing()
        self.period = self.timing.control_period  # [s] from one odometry to the next
        self._period_is_measured = False
        self._acting = TorqueHistory()
        self.latency, self.twist = Latency(), TwistKind()
        self._delay = 0.0  # [s] of the last answer
        self._retuned: tuple[int, ConstraintSet] | None = None  # [ns] and what was before
        self.progress = Progress()  # along the reference that is followed
        self.reset()

    def reset(self) -> None:
        """Start anew, from an unknown state at an unknown time."""
        self.stamp = 0  # [ns]
        self.motion: Motion | None = None
        self._told: Motion | None = None  # the last odometry, as it was told
        self.restart()
        self.forget()

    def restart(self) -> None:
        """Go on at an unknown time, from an unknown state: the clock was set back."""
        self.stamp = 0
        self._acting.restart()
        self.motion = self._told = None

    def forget(self) -> None:
        """Forget what was learnt of the disturbance."""
        self.learnt = DisturbanceEstimate()
        self._direction = 0.0  # of the reference: 1 forwards, -1 backwards, 0 at rest
        # whether no limit cut the last answer, so that what came out tells of the disturbance:
        # a bool; of many climbers an array (N,) of them
        self._learning: Any = False

    @property
    def disturbance(self) -> Wrench:
        """What pushes and turns the climber besides what the model knows, friction included."""
        learnt = self.learnt
        return Wrench(learnt.force - self._direction * learnt.friction, learnt.moment)

    @disturbance.setter
    def disturbance(self, disturbance: Wrench) -> None:
        self.learnt = DisturbanceEstimate(*disturbance)

    @property
    def reaction(self) -> float:
        """From an odometry to the middle of the period in which a torque answers it [s]."""
        return self._delay + self.period / 2

    def retune(self, law: ControlLaw, observer: Observer, timing: Timing, pacing: Pacing) -> None:
        """Go over to other settings: the constraints' gains gradually, so that no torque jumps."""
        if law.constraints != self.law.constraints:
            self._retuned = self.stamp, self._constraints()
        self.law, self.observer = law, observer
        self.timing, self.pacing = timing, pacing

    def see(self, stamp: int, motion: Motion, expected: Motion | None = None) -> None:
        """Correct state and disturbance by an odometry of `stamp` [ns], newer than the last.

        `expected` is `expected_at(stamp)`, where the caller has computed it already.
        """
        if self.motion is not None:
            time = (stamp - self.stamp) / SECOND
            share = PERIOD_SMOOTHING if self._period_is_measured else 1.0
            self.period += share * (time - self.period)
            self._period_is_measured = True
            expected = expected or self.expected_at(stamp)
            is_known = self._acting.are_known_since(self.stamp)
            shares = self.observer.shares(time, self._delay)
            if self.observer.velocity_source == "odometry" and isinstance(motion.x, float):
                motion = self._at_its_stamp(expected, motion, time)
                if self.timing.learn_delay and is_known:
                    self._learn_delay(stamp, expected, motion, shares)
            motion, learnt = self.observer.corrected(
                self.law.climber, self.learnt, expected, motion, time, shares, self._direction
            )
            if is_known:
                is_learnt = self._learning  # of many, each learns or holds what it has learnt
                self.learnt = (
                    learnt if is_learnt is True else chosen(is_learnt, learnt, self.learnt.held)
                )
        elif self.observer.velocity_source == "pose":
            motion = motion._replace(speed=0.0, yaw_rate=0.0)
        self.stamp, self.motion = stamp, motion

    def answer(
        self, preview: Preview, age: float, constraints: ConstraintSet | None = None
    ) -> Command | None:
        """Torques for the last odometry, of `age` [s]; None where the preview does not reach.

        `constraints` are followed in the place of the controller's own.
        Raises `ValueError` or `ArithmeticError` if they are not finite.
        """
        begins, situation = self._situation(age)
        law = self.law
        if constraints is not None:
            law = replace(law, constraints=constraints, other=None)
        elif self._retuned is not None:
            law = replace(law, constraints=self._constraints())
        aim = begins + round(law.options.lookahead(self.period) * SECOND)
        progress = self.progress.advanced(begins, self.pacing)
        target = progress.target(preview, aim)
        if target is None:
            return None
        command = law.command(situation, target)
        if self.pacing.catch_up > 0 and abs(command.lost.force) > CUT:
            progress = progress.slowed(
                command.lost.force / law.climber.mass, preview, aim, self.period
            )
            command = law.command(situation, progress.target(preview, aim) or target)
        wheels, _, _, (drive, turn) = command
        _check(wheels)
        self.progress, speed = progress, target.speed
        self._direction = math.copysign(1.0, speed) if abs(speed) > SLOW else 0.0
        self._learning = (abs(drive) <= CUT) & (abs(turn) <= CUT)
        self._send(begins, wheels)
        return command

    def hold(self, age: float, braking_rate: float) -> Torques:
        """Torques that carry the weight and brake; raises as `answer` does."""
        begins, situation = self._situation(age)
        if age >= LONGEST_STEP:  # it has been braked, as far as can be known
            at_rest = situation.motion._replace(speed=0.0, yaw_rate=0.0)
            situation = situation._replace(motion=at_rest)
        torques = self.law.holding(situation, braking_rate)
        _check(torques)
        self._learning = False
        self._send(begins, torques)
        return torques

    def let_go(self, age: float) -> Torques:
        """No torques."""
        self._learning = False
        self._send(self.begin(age), NONE)
        return NONE

    def correct(self, torques: Torques) -> None:
        """Believe that other torques were sent than it answered last."""
        self._acting.correct(torques)

    def mean_torques(self, stamp: int) -> Torques:
        """Mean of the torques that act from the last odometry to `stamp` [ns]."""
        spans = self._acting.between(self.stamp, stamp)
        whole = sum(time for _, time in spans) or 1.0
        right = sum(torques.right * time for torques, time in spans) / whole
        left = sum(torques.left * time for torques, time in spans) / whole
        return Torques(right, left)

    def expected_at(self, stamp: int) -> Motion:
        """Motion at `stamp` [ns] as the model rolls on from the last odometry."""
        assert self.motion is not None
        motion, climber = self.motion, self.law.climber
        r_drive, r_turn, _, _, friction = self.learnt
        if stamp == self.stamp:
            return motion
        for torques, time in self._acting.between(self.stamp, stamp):
            drive, turn = climber.wrench(*torques)
            motion = predict(climber, motion, drive + r_drive, turn + r_turn, time, friction)
        return motion

    def _at_its_stamp(self, expected: Motion, found: Motion, time: float) -> Motion:
        """Motion whose speeds are those of its stamp, not the mean of the `time` [s] before."""
        assert self.motion is not None
        kind = self.observer.twist
        if kind == "auto" and self._told is not None:
            self.twist.learn(self._told, found, time)
        self._told = found
        if kind == "instantaneous" or (kind == "auto" and not self.twist.is_mean):
            return found
        speed, rate = mean_twist(self.motion, expected, time)
        return found._replace(
            speed=found.speed + expected.speed - speed,
            yaw_rate=found.yaw_rate + expected.yaw_rate - rate,
        )

    def _learn_delay(
        self, stamp: int, expected: Motion, found: Motion, shares: tuple[Any, Any]
    ) -> None:
        """Learn how much later than told torques act; `shares` are the observer's."""
        climber = self.law.climber
        drive, turn = climber.wrench(*self._acting.between(self.stamp, stamp)[-1][0])
        lever = climber.half_track
        accelerations = drive / climber.mass, lever * turn / climber.yaw_inertia
        errors = found.speed - expected.speed, lever * (found.yaw_rate - expected.yaw_rate)
        time, slides = (stamp - self.stamp) / SECOND, abs(found.speed) > SLOW
        sample = Sample(accelerations, errors, time, slides)
        self.latency.learn(sample, shares, self.timing.transport_delay)

    def _constraints(self) -> ConstraintSet:
        """Constraints as they are now, on their way from the gains that were before."""
        if self._retuned is None:
            return self.law.constraints
        since, before = self._retuned
        share = (self.stamp - since) / SECOND / RETUNING_TIME
        if not 0 <= share < 1 or type(before) is not type(self.law.constraints):
            self._retuned = None
            return self.law.constraints
        after = self.law.constraints
        gains = {
            field.name: (1 - share) * getattr(before, field.name)
            + share * getattr(after, field.name)
            for field in dataclasses.fields(after)  # type: ignore[arg-type]
            if isinstance(field.default, float)
        }
        return replace(after, **gains)  # type: ignore[type-var]

    def begin(self, age: float) -> int:
        """When an answer to the last odometry, given at its `age` [s], begins to act [ns]."""
        timing = self.timing
        delay = timing.transport_delay + (age if timing.measure_delay else 0.0)
        delay += self.latency.delay if timing.learn_delay else 0.0
        self._delay = delay
        return self._acting.begin(self.stamp + round(delay * SECOND))

    def _situation(self, age: float) -> tuple[int, ControlInput]:
        begins = self.begin(age)
        motion = self.expected_at(begins)
        force, moment, _, _, friction = self.learnt
        disturbance = Wrench(force, moment)
        return begins, ControlInput(motion, self._acting.last, disturbance, self.period, friction)

    def _send(self, begins: int, torques: Torques) -> None:
        self._acting.add(begins, torques)
        # without odometry, too, that of long ago is not needed
        self._acting.forget_before(max(self.stamp, begins - LONG_AGO))


def _check(torques: Torques) -> None:
    """Raise `ValueError` if a climber's torques are not finite; of many, each has its own."""
    right, left = torques
    is_one = isinstance(right, float) or np.ndim(right) == 0
    if is_one and not math.isfinite(right + left):
        raise ValueError(f"torques {torques} are not finite")
