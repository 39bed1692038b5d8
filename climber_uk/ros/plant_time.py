"""The clock of the climbers that a process simulates: the wall clock, or simulated lock-step time.

Stamps and times are integers in nanoseconds.
"""

from collections.abc import Sequence
from typing import Protocol

from rosgraph_msgs.msg import Clock as ClockMessage

from climber_uk.mechanics import SECOND
from climber_uk.messages.topics import CLOCK
from climber_uk.ros.output import Output
from climber_uk.ros.running import WALL_CLOCK, ClimberNode, Throttle
from climber_uk.simulation.options import SimulationOptions

ASK_AGAIN = 0.2  # [s] of wall-clock time, for a torque that does not come
FALLEN_BEHIND = 1.0  # [s] behind the wall clock, from which the rest is skipped
LOOK_PERIOD = 0.1  # [s] of the wall clock, between two looks for the node `wait_for`
LOOKS = 10  # in a row that must find it: other publishers have to find it, too
MAX_LAG = 0.1  # [s] behind its pace that simulated time makes up for
SHORTEST = 1e-5  # [s] of a timer: one of no time leaves no time
TICK = SECOND // 100  # [ns] of simulated time between two messages on /clock, at least
# options of all or none
SHARED = "simulated_time", "control_period", "real_time_factor", "wait_for"


class Simulated(Protocol):
    """A climber that a `PlantTime` steps."""

    options: SimulationOptions
    origin: int  # stamp of its first odometry
    fallen: bool  # then it is not stepped any more
    answered: bool  # whether a torque has answered its last odometry
    is_lost: bool  # whether that is not published, and so none will

    def is_heard_by(self, node: str) -> bool:
        """Whether a node of that name has subscribed the climber's topics."""

    def advance(self) -> None:
        """Advance by a control period."""

    def publish_odometry(self) -> None:
        """Publish the odometry, which a torque is to answer."""

    def publish_others(self) -> None:
        """Publish all other topics."""

    def no_answer(self) -> None:
        """Report that no torque answers the odometry."""


class PlantTime:
    """Steps its climbers together: by the wall clock, or once each has its torque: lock-step."""

    def __init__(self, node: ClimberNode, options: SimulationOptions) -> None:
        self.options, self.clock, self.log = options, node.get_clock(), node.get_logger()
        self.climbers: list[Simulated] = []
        self.period = round(options.control_period * SECOND)
        self.paused = self.granted = False
        # 0 would mean that there is no time yet
        self.stamp: int = SECOND if options.simulated_time else self.clock.now().nanoseconds
        self.stepped_at = self.due = WALL_CLOCK.now().nanoseconds
        self.topic: Output | None = None
        self.is_due = Throttle(TICK)
        self.waits, self.looks = bool(options.wait_for), 0
        if self.waits:
            self.log.info(f"time does not run until {options.wait_for} listens")
            node.create_timer(LOOK_PERIOD, self.check_listener, clock=WALL_CLOCK)
        if options.simulated_time:
            self.topic = node.output(CLOCK, ClockMessage(), (), ("clock.sec", "clock.nanosec"))
            node.create_timer(ASK_AGAIN, self.ask_again, clock=WALL_CLOCK)
            if options.real_time_factor > 0:
                pace = max(self.pace / SECOND, SHORTEST)
                node.create_timer(pace, self.step_if_due, clock=WALL_CLOCK)
        else:
            node.create_timer(options.control_period, self.follow_clock)

    @property
    def pace(self) -> float:
        """Wall-clock time for a control period [ns], by `real_time_factor`."""
        return self.period / self.options.real_time_factor

    @property
    def standing(self) -> list[Simulated]:
        """Climbers that have not fallen."""
        return [climber for climber in self.climbers if not climber.fallen]

    def join(self, climber: Simulated) -> None:
        """Add a climber; `ValueError` if an option of `SHARED` differs from the first one's."""
        for name in SHARED:
            theirs, ours = getattr(climber.options, name), getattr(self.options, name)
            if theirs != ours:
                raise ValueError(f"{name}={theirs} must be {ours}, as the first climber has it")
        self.climbers.append(climber)

    def check_listener(self) -> None:
        """Let time run once the node `wait_for` has subscribed the climbers' topics."""
        node = self.options.wait_for
        listens = all(climber.is_heard_by(node) for climber in self.climbers)
        self.looks = self.looks + 1 if listens else 0
        if self.waits and self.looks > LOOKS:
            self.log.info(f"{node} listens")
            self.waits = False
            self.skip_missed()
            self.publish(self.standing)

    def pause(self, paused: bool) -> None:
        """Stop time, or let it run."""
        if self.paused and not paused:
            self.skip_missed()
        self.paused, self.granted = paused, False
        self.step_if_due()

    def grant(self) -> None:
        """Run for one control period in a pause, once every torque for it has come."""
        self.granted = True
        self.skip_missed()
        self.step_if_due()

    def skip(self, climber: Simulated, periods: int) -> None:
        """Advance all climbers but one by some periods; its next odometry has a later stamp."""
        for _ in range(periods):
            self.advance([other for other in self.standing if other is not climber])
        self.skip_missed()

    def ask_again(self) -> None:
        """Publish unanswered odometry again, as it may be lost; in the end report it."""
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

    def step_if_due(self) -> None:
        """Step unless a torque is missing, time is paused, or it is too early."""
        if not self.standing or (self.paused and not self.granted):
            return
        if self.options.simulated_time:
            if not all(climber.answered for climber in self.standing):
                return
            if self.options.real_time_factor > 0:
                now = WALL_CLOCK.now().nanoseconds
                if now < self.due:
                    return
                late = now - self.due > MAX_LAG * SECOND
                self.due = (now if late else self.due) + self.pace
        elif not self.granted:
            return
        self.step()

    def follow_clock(self) -> None:
        """Step until the clock's time is reached."""
        now = self.clock.now().nanoseconds
        if self.paused or self.waits or not self.standing:
            return
        if now - self.stamp > FALLEN_BEHIND * SECOND:
            self.log.warning(f"{(now - self.stamp) * 1e-9:.1f} s behind: left out")
            self.skip_missed()
        while self.stamp + self.period <= now and self.standing:
            self.step()

    def skip_missed(self) -> None:
        """Skip what has passed on the wall clock, but for the last period."""
        if not self.options.simulated_time:
            missed = max(0, self.clock.now().nanoseconds - self.period - self.stamp)
            self.stamp += missed
            for climber in self.climbers:
                climber.origin += missed

    def step(self) -> None:
        """Advance all by a control period and publish; those that fall publish no more."""
        self.granted = False
        self.advance(self.standing)
        self.publish(self.standing)
        self.step_if_due()  # if all odometry was lost

    def advance(self, climbers: Sequence[Simulated]) -> None:
        """Advance some climbers, and the time, by a control period."""
        for climber in climbers:
            climber.advance()
            climber.answered = climber.is_lost
        self.stamp += self.period
        self.stepped_at = WALL_CLOCK.now().nanoseconds

    def publish(self, climbers: Sequence[Simulated]) -> None:
        """Publish odometry first, which torques wait for, then time and all other topics."""
        if self.waits:
            return
        for climber in climbers:
            climber.publish_odometry()
        if self.is_due(self.stamp):
            self.publish_time()
        for climber in climbers:
            climber.publish_others()

    def publish_time(self) -> None:
        """Publish /clock if time is simulated."""
        if self.topic is not None:
            self.topic.publish(self.stamp)
