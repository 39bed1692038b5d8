"""The time of all climbers that one process simulates: the wall clock's, or their own, lock-step.

Stamps and times are integers in nanoseconds.
"""

from collections.abc import Sequence
from typing import Protocol

from rosgraph_msgs.msg import Clock as ClockMessage

from climber_uk.mechanics import SECOND
from climber_uk.messages import writing
from climber_uk.messages.topics import CLOCK
from climber_uk.ros.running import WALL_CLOCK, ClimberNode, Throttle
from climber_uk.simulation.options import SimulationOptions

ASK_AGAIN = 0.2  # [s] of wall-clock time, for a torque that does not come
FALLEN_BEHIND = 1.0  # [s] from which lost wall-clock time is not made up for
LOOK_PERIOD = 0.1  # [s] of the wall clock, to look for the one that is waited for
LOOKS = 10  # that must have found it: all who publish have to have found it, too
CATCH_UP = 0.1  # [s] of the wall clock that simulated time may make up for
TICK = SECOND // 100  # [ns] of simulated time between two messages on /clock, at least
SHARED = (
    "simulated_time",
    "control_period",
    "real_time_factor",
    "wait_for",
)  # options of all or none


class Simulated(Protocol):
    """A climber that lives in this time."""

    options: SimulationOptions
    origin: int  # stamp of its first odometry
    fallen: bool  # it takes no further part
    answered: bool  # its last odometry, by a torque

    def is_heard_by(self, node: str) -> bool:
        """Whether a node of that name has subscribed what there is to hear."""

    def advance(self) -> None:
        """Go on by a control period."""

    def publish_odometry(self) -> None:
        """Publish what torques are to answer."""

    def publish_others(self) -> None:
        """Publish what nobody waits for."""

    def no_answer(self) -> None:
        """Report that nobody answers."""


class PlantTime:
    """Steps its climbers together; in lock-step when each of them has its torque."""

    def __init__(self, node: ClimberNode, options: SimulationOptions) -> None:
        self.options, self.clock, self.log = options, node.get_clock(), node.get_logger()
        self.climbers: list[Simulated] = []
        self.period = round(options.control_period * SECOND)
        self.paused = self.granted = False
        # 0 would mean that there is no time yet
        self.stamp: int = SECOND if options.simulated_time else self.clock.now().nanoseconds
        self.stepped_at = self.due = WALL_CLOCK.now().nanoseconds
        self.topic, self.is_due = None, Throttle(TICK)
        self.waits, self.looks = bool(options.wait_for), 0
        if self.waits:
            self.log.info(f"time does not run until {options.wait_for} listens")
            node.create_timer(LOOK_PERIOD, self.look_out, clock=WALL_CLOCK)
        if options.simulated_time:
            self.topic = node.publisher(ClockMessage, CLOCK)
            node.create_timer(ASK_AGAIN, self.ask_again, clock=WALL_CLOCK)
            if options.real_time_factor > 0:
                node.create_timer(self.pace / SECOND, self.go_on, clock=WALL_CLOCK)
        else:
            node.create_timer(options.control_period, self.keep_up)

    @property
    def pace(self) -> float:
        """Of the wall clock for a control period [ns]."""
        return self.period / self.options.real_time_factor

    @property
    def standing(self) -> list[Simulated]:
        """Climbers that have not fallen."""
        return [climber for climber in self.climbers if not climber.fallen]

    def join(self, climber: Simulated) -> None:
        """Take in a climber; `ValueError` if it would have another time."""
        for name in SHARED:
            theirs, ours = getattr(climber.options, name), getattr(self.options, name)
            if theirs != ours:
                raise ValueError(f"{name}={theirs} must be {ours}, as the first climber has it")
        self.climbers.append(climber)

    def look_out(self) -> None:
        """Begin, once the one that is waited for listens."""
        node = self.options.wait_for
        listens = all(climber.is_heard_by(node) for climber in self.climbers)
        self.looks = self.looks + 1 if listens else 0
        if self.waits and self.looks > LOOKS:
            self.log.info(f"{node} listens")
            self.waits = False
            self.catch_up()
            self.publish(self.standing)

    def pause(self, paused: bool) -> None:
        """Stop time, or let it go on."""
        if self.paused and not paused:
            self.catch_up()
        self.paused, self.granted = paused, False
        self.go_on()

    def grant(self) -> None:
        """Go on by one control period in a pause, once every torque for it is there."""
        self.granted = True
        self.catch_up()
        self.go_on()

    def leave_out(self, climber: Simulated, periods: int) -> None:
        """Let some periods pass for all but one, whose next odometry shall have a later stamp."""
        for _ in range(periods):
            self.advance([other for other in self.standing if other is not climber])
        self.catch_up()

    def ask_again(self) -> None:
        """Publish the odometry once more to whom missed it; report who does not answer."""
        waited = WALL_CLOCK.now().nanoseconds - self.stepped_at
        if self.waits:
            return
        silent = [climber for climber in self.standing if not climber.answered]
        if waited > ASK_AGAIN * SECOND:
            self.publish(silent)
            self.publish_time()
        if waited > self.options.lockstep_timeout * SECOND:
            for climber in silent:
                climber.no_answer()

    def go_on(self) -> None:
        """Step if nothing speaks against it: no answer yet, a pause, the pace of time."""
        if not self.standing or (self.paused and not self.granted):
            return
        if self.options.simulated_time:
            if not all(climber.answered for climber in self.standing):
                return
            if self.options.real_time_factor > 0:
                now = WALL_CLOCK.now().nanoseconds
                if now < self.due:
                    return
                late = now - self.due > CATCH_UP * SECOND
                self.due = (now if late else self.due) + self.pace
        elif not self.granted:
            return
        self.step()

    def keep_up(self) -> None:
        """Step until the clock's time is reached."""
        now = self.clock.now().nanoseconds
        if self.paused or self.waits or not self.standing:
            return
        if now - self.stamp > FALLEN_BEHIND * SECOND:
            self.log.warning(f"{(now - self.stamp) * 1e-9:.1f} s behind: left out")
            self.catch_up()
        while self.stamp + self.period <= now and self.standing:
            self.step()

    def catch_up(self) -> None:
        """Leave out what has passed on the wall clock, but for the last period."""
        if not self.options.simulated_time:
            missed = max(0, self.clock.now().nanoseconds - self.period - self.stamp)
            self.stamp += missed
            for climber in self.climbers:
                climber.origin += missed

    def step(self) -> None:
        """Advance all by a control period and publish; who falls is heard of no more."""
        self.granted = False
        self.advance(self.standing)
        self.publish(self.standing)

    def advance(self, climbers: Sequence[Simulated]) -> None:
        """Let a control period pass for some climbers."""
        for climber in climbers:
            climber.advance()
            climber.answered = False
        self.stamp += self.period
        self.stepped_at = WALL_CLOCK.now().nanoseconds

    def publish(self, climbers: Sequence[Simulated]) -> None:
        """Publish what is waited for first, and after it the time and what nobody waits for."""
        if self.waits:
            return
        for climber in climbers:
            climber.publish_odometry()
        if self.is_due(self.stamp):
            self.publish_time()
        for climber in climbers:
            climber.publish_others()

    def publish_time(self) -> None:
        """Publish the simulated time: not each step, as to receive it is dear for many nodes."""
        if self.topic is not None:
            self.topic.publish(ClockMessage(clock=writing.time(self.stamp)))
