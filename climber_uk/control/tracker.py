"""One climber from odometry to odometry: what acts on it, what disturbs it, and what to answer.

Stamps are integers in nanoseconds, on the clock of the odometry.
"""

import dataclasses
from dataclasses import dataclass, replace

import numpy as np

from climber_uk.control.acting import Acting
from climber_uk.control.constraints import ConstraintSet
from climber_uk.control.controller import Command, Controller, Situation
from climber_uk.control.model import Observer, rolled
from climber_uk.control.pacing import Pace, Pacing
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import State
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.preview import SECOND, Preview

LONGEST_STEP = 0.3  # [s] for which the model is trusted without an odometry
PERIOD_SMOOTHING = 0.1  # share of a new period in the mean
RETUNING_TIME = 0.5  # [s] in which changed gains come to act
CUT = 1e-9  # [N, N m] of a demand that limits have taken away


@dataclass(frozen=True)
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
    measure_delay: bool = parameter(
        True, "", "add the odometry's age to the transport delay", runtime=True
    )

    def __post_init__(self) -> None:
        check(self)


class Tracker:
    """Answers odometry with torques, and learns from how the climber took the last ones."""

    def __init__(
        self, controller: Controller, observer: Observer, timing: Timing, pacing: Pacing
    ) -> None:
        self.controller, self.observer = controller, observer
        self.timing, self.pacing = timing, pacing
        self.period = timing.control_period  # [s] from one odometry to the next
        self._period_is_measured = False
        self._acting = Acting()
        self._retuned: tuple[int, ConstraintSet] | None = None  # [ns] and what was before
        self.reset()

    def reset(self) -> None:
        """Start anew, from an unknown state at an unknown time."""
        self.stamp = 0  # [ns]
        self._acting.restart()
        self.state: State | None = None
        self.forget()

    def forget(self) -> None:
        """Forget what was learnt, and that the reference waited."""
        self.disturbance: Array = np.zeros(2)  # on drive [N] and turn [N m]
        self._learning = False
        self.start_pace()

    def start_pace(self) -> None:
        """Follow the reference in its own time."""
        self.pace = Pace()
        self._paced_at: int | None = None

    def retune(
        self, controller: Controller, observer: Observer, timing: Timing, pacing: Pacing
    ) -> None:
        """Go over to other settings: the constraints' gains gradually, so that no torque jumps."""
        if controller.constraints != self.controller.constraints:
            self._retuned = self.stamp, self._constraints()
        self.controller, self.observer = controller, observer
        self.timing, self.pacing = timing, pacing

    def see(self, stamp: int, state: State) -> None:
        """Take in a newer odometry."""
        if self.state is not None:
            time = (stamp - self.stamp) / SECOND
            share = PERIOD_SMOOTHING if self._period_is_measured else 1.0
            self.period += share * (time - self.period)
            self._period_is_measured = True
            expected = self.expected_at(stamp)
            state, learnt = self.observer.corrected(
                self.controller.climber, self.disturbance, expected, state, time
            )
            if self._learning and self._acting.are_known_since(self.stamp):
                self.disturbance = learnt
        elif self.observer.velocity_source == "pose":
            state = State(state.pose, np.zeros(3))
        self.stamp, self.state = stamp, state

    def answer(self, preview: Preview, age: float) -> Command | None:
        """Torques for the last odometry, of `age` [s]; None where the preview does not reach.

        Raises `ValueError` or `ArithmeticError` if they are not finite.
        """
        begins, situation = self._situation(age)
        controller, pace = self.controller, self.pace
        if self._retuned is not None:
            controller = replace(controller, constraints=self._constraints())
        aim = begins + round(controller.law.lookahead(self.period) * SECOND)
        if self.pacing.catch_up > 0:
            since = begins if self._paced_at is None else self._paced_at
            pace = pace.after((begins - since) / SECOND, self.pacing)
        reference = pace.reference(preview, aim)
        if reference is None:
            return None
        command = controller.command(situation, reference)
        if self.pacing.catch_up > 0 and abs(command.missing[0]) > CUT:
            missing = float(command.missing[0]) / controller.climber.mass
            pace = pace.slowed(missing, preview, aim, self.period)
            command = controller.command(situation, pace.reference(preview, aim) or reference)
        if not np.isfinite(command.torques).all():
            raise ValueError(f"torques {command.torques} are not finite")
        self.pace, self._paced_at = pace, begins
        self._learning = bool(np.abs(command.missing).max() <= CUT)
        self._send(begins, command.torques)
        return command

    def hold(self, age: float, braking_rate: float) -> Array:
        """Torques (2,) that carry the weight and brake; raises as `answer` does."""
        begins, situation = self._situation(age)
        if age >= LONGEST_STEP:  # it has been braked, as far as can be known
            at_rest = State(situation.state.pose, np.zeros(3))
            situation = replace(situation, state=at_rest)
        torques = self.controller.holding(situation, braking_rate)
        if not np.isfinite(torques).all():
            raise ValueError(f"torques {torques} are not finite")
        self._learning = False
        self._send(begins, torques)
        return torques

    def let_go(self, age: float) -> Array:
        """Zero torques (2,)."""
        self._learning = False
        self._send(self._begin(age), np.zeros(2))
        return np.zeros(2)

    def correct(self, torques: Array) -> None:
        """Believe that other torques (2,) were sent than it answered last."""
        self._acting.correct(torques)

    def expected_at(self, stamp: int) -> State:
        """State at `stamp` [ns] as the model rolls on from the last odometry."""
        assert self.state is not None
        state = self.state
        for torques, time in self._acting.between(self.stamp, stamp):
            state = rolled(self.controller.climber, state, torques, self.disturbance, time)
        return state

    def _constraints(self) -> ConstraintSet:
        """Constraints as they are now, on their way from the gains that were before."""
        if self._retuned is None:
            return self.controller.constraints
        since, before = self._retuned
        share = (self.stamp - since) / SECOND / RETUNING_TIME
        if not 0 <= share < 1 or type(before) is not type(self.controller.constraints):
            self._retuned = None
            return self.controller.constraints
        after = self.controller.constraints
        gains = {
            field.name: (1 - share) * getattr(before, field.name)
            + share * getattr(after, field.name)
            for field in dataclasses.fields(after)  # type: ignore[arg-type]
        }
        return type(after)(**gains)

    def _begin(self, age: float) -> int:
        """When an answer to the last odometry, given at its `age` [s], begins to act [ns]."""
        delay = self.timing.transport_delay + age * self.timing.measure_delay
        return self._acting.begin(self.stamp + round(delay * SECOND))

    def _situation(self, age: float) -> tuple[int, Situation]:
        begins = self._begin(age)
        state = self.expected_at(begins)
        return begins, Situation(state, self._acting.last, self.disturbance, self.period)

    def _send(self, begins: int, torques: Array) -> None:
        self._acting.add(begins, torques)
        # without odometry, too, that of long ago is not needed
        self._acting.forget_before(max(self.stamp, begins - round(2 * LONGEST_STEP * SECOND)))
