"""A climber on its wall in a robot's place: wheel torques in, odometry out."""

from typing import Any

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Alarm, Contact, Grip
from climber_uk.mechanics.preview import SECOND
from climber_uk.messages import reading
from climber_uk.nodes.margins import Margins
from climber_uk.nodes.plant_topics import PlantTopics
from climber_uk.nodes.running import WALL_CLOCK, ClimberNode, run
from climber_uk.simulation.inputs import FellOff, NotFinite
from climber_uk.simulation.machine import NONE, VARIANTS, Machine, Parts, Physics, Push
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.options import Options
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.schedule import Schedule
from climber_uk.simulation.sensors import Sensors

ASK_AGAIN = 0.2  # [s] of wall-clock time, for a torque that does not come
FALLEN_BEHIND = 1.0  # [s] from which lost wall-clock time is not made up for
CATCH_UP = 0.1  # [s] of the wall clock that simulated time may make up for


class PlantSimulator(ClimberNode):
    """The plant with its time: the wall clock's, or its own that waits for every torque.

    A run that starts in motion starts when the first torque other than zero arrives.
    """

    def __init__(self) -> None:
        super().__init__("plant_simulator")
        for kind in (Options, Climber, Physics, Grip, Motors, Sensors, Alarm):
            self.parameters.declare(kind)
        for variants in VARIANTS.values():
            for name, variant in variants.items():
                self.parameters.declare(variant, f"{name}.")
        self.parameters.refuse_unknown()
        self.options = self.parameters.read(Options)
        self.margins = Margins(self, self.parameters.read(Alarm))
        self.period = round(self.options.control_period * SECOND)  # [ns]
        self.paused = self.granted = False
        simulated = self.options.simulated_time
        # 0 would mean that there is no time yet
        self.stamp = SECOND if simulated else self.get_clock().now().nanoseconds
        self.place_at_start()

        self.topics = PlantTopics(self, self.period, simulated)
        self.subscription(JointState, "wheel_torques", self.on_torques)
        self.subscription(WrenchStamped, "push", self.on_push)
        self.create_service(Trigger, "~/reset", self.on_reset)
        self.create_service(SetBool, "~/pause", self.on_pause)
        self.create_service(Trigger, "~/step", self.on_step)
        self.start_diagnostics(self.values, alone_on=("odom", "wheel_torques"))
        self.stepped_at = self.due = WALL_CLOCK.now().nanoseconds
        if simulated:
            self.create_timer(ASK_AGAIN, self.ask_again, clock=WALL_CLOCK)
            if self.options.real_time_factor > 0:
                self.create_timer(self.pace / SECOND, self.go_on, clock=WALL_CLOCK)
        else:
            self.create_timer(self.options.control_period, self.keep_up)
        self.publish_state()

    def parts(self) -> Parts:
        """What the parameters say that the climber is made of."""
        read = self.parameters.read
        physics, step = read(Physics), self.options.integration_step
        chosen: dict[str, Any] = {}
        for group, variants in VARIANTS.items():
            name = getattr(physics, group)
            chosen[group] = read(variants[name], f"{name}.")
        wall = chosen.pop("wall")
        contact = Contact(**chosen, grip=read(Grip))
        plant = Plant(read(Climber), step, contact, wall, physics.slip)
        return Parts(plant, read(Motors), read(Sensors), physics)

    def on_parameters(self) -> None:
        """Take up what was changed: the pump's pressure, a magnet's gap, levels of alarm."""
        self.machine.take(self.parts())
        self.margins.alarm = self.parameters.read(Alarm)

    # Commands

    def place_at_start(self) -> None:
        """Go back to the initial state, with no torque yet."""
        start = self.options.initial_state
        self.machine = Machine(self.parts(), start, self.options.control_period)
        self.held = bool(start.velocity.any())
        self.origin = self.stamp  # of the first odometry [ns]
        timeout = 0.0 if self.options.simulated_time else self.options.command_timeout
        self.commands: Schedule[Array] = Schedule(round(timeout * SECOND))
        self.pushes: Schedule[Push] = Schedule(round(self.options.push_timeout * SECOND))
        self.fallen = self.answered = False

    def on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Start again from the initial state; time goes on."""
        late = self.parameters.read(Sensors).delay_in(self.options.control_period)
        self.stamp += self.period * (1 + late)  # no odometry has the stamp of one before
        self.catch_up()
        self.place_at_start()
        self.say("climber", "")
        self.publish_state()
        response.success, response.message = True, f"at the start at {self.stamp * 1e-9:.3f} s"
        return response

    def on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Stop the climber's time, or let it go on."""
        if self.paused and not request.data:
            self.catch_up()
        self.paused, self.granted = bool(request.data), False
        response.success = True
        response.message = f"{'paused' if self.paused else 'going on'} at {self.stamp * 1e-9:.3f} s"
        self.go_on()
        return response

    def on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Go on by one control period, once the torque for it is there."""
        response.success, response.message = False, "not paused"
        if self.fallen:
            response.message = "fallen: reset first"
        elif self.paused:
            response.success, response.message = True, f"from {self.stamp * 1e-9:.3f} s"
            self.granted = True
            self.catch_up()
            self.go_on()
        return response

    def on_push(self, message: WrenchStamped) -> None:
        """Push from the message's stamp on, or from now if it has none or is late."""
        try:
            wrench = reading.wrench(message, self.names.odom_frame, self.names.base_frame)
        except ValueError as error:
            self.say("push", "refused", str(error))
            return
        self.say("push", "")
        begin = reading.nanoseconds(message.header.stamp) or self.stamp
        self.pushes.add(begin, Push(*wrench))

    def on_torques(self, message: JointState) -> None:
        """Apply torques from now on or, in simulated time, for a step if they answer the last."""
        names = self.names
        try:
            torques = reading.wheel_torques(
                message, names.left_wheel_joint, names.right_wheel_joint
            )
            self.say("wheel_torques", "")
        except ValueError as error:
            self.say("wheel_torques", "refused, zero torque instead", str(error))
            torques = np.zeros(2)
        limit = self.machine.plant.climber.max_wheel_torque
        torques = np.clip(torques, -limit, limit)
        self.held = self.held and not torques.any()
        if not self.options.simulated_time:
            self.commands.add(self.get_clock().now().nanoseconds, torques)
        elif reading.nanoseconds(message.header.stamp) == self.asked and not self.answered:
            self.commands.add(self.stamp, torques)
            self.answered = True
            self.say("lock-step", "")
            self.go_on()

    def command_at(self, time: int) -> Array:
        """Torques that act at `time` [ns]: the last to arrive, unless they are too old."""
        torques, stale = self.commands.at(time)
        if not self.options.simulated_time:
            self.say("torque command", "stale; zero torque instead" if stale else "")
        return np.zeros(2) if torques is None else torques

    # Time

    @property
    def asked(self) -> int:
        """Stamp of the odometry that is published last [ns]."""
        number, _ = self.machine.odometer.latest()
        return self.origin + number * self.period

    @property
    def pace(self) -> float:
        """Of the wall clock for a control period [ns]."""
        return self.period / self.options.real_time_factor

    def ask_again(self) -> None:
        """Publish the odometry once more to whom missed it; report who does not answer."""
        waited = WALL_CLOCK.now().nanoseconds - self.stepped_at
        if self.answered or self.fallen:
            return
        if waited > ASK_AGAIN * SECOND:
            self.publish_state()
        if waited > self.options.lockstep_timeout * SECOND:
            self.say("lock-step", f"no torque for the odometry of {self.asked * 1e-9:.3f} s")

    def go_on(self) -> None:
        """Step if nothing speaks against it: no answer yet, a pause, the pace of time."""
        if self.fallen or (self.paused and not self.granted):
            return
        if self.options.simulated_time:
            if not self.answered:
                return
            if self.options.real_time_factor > 0:
                now = WALL_CLOCK.now().nanoseconds
                if now < self.due:
                    return
                late = now - self.due > CATCH_UP * SECOND
                self.due = (now if late else self.due) + self.pace
        elif not self.granted:
            return
        self.granted = self.answered = False
        self.step()

    def keep_up(self) -> None:
        """Step until the clock's time is reached."""
        now = self.get_clock().now().nanoseconds
        if self.paused or self.fallen:
            return
        if now - self.stamp > FALLEN_BEHIND * SECOND:
            self.get_logger().warning(f"{(now - self.stamp) * 1e-9:.1f} s behind: left out")
            self.catch_up()
        while self.stamp + self.period <= now and not self.fallen:
            self.step()

    def catch_up(self) -> None:
        """Leave out what has passed on the wall clock, but for the last period."""
        if not self.options.simulated_time:
            missed = max(0, self.get_clock().now().nanoseconds - self.period - self.stamp)
            self.stamp, self.origin = self.stamp + missed, self.origin + missed

    def step(self) -> None:
        """Advance by a control period and publish; a climber that falls is heard of no more."""
        try:
            for number in range(0 if self.held else self.options.steps):
                time = self.stamp + number * self.period // self.options.steps
                push, _ = self.pushes.at(time)
                self.machine.advance(self.command_at(time), push or NONE)
        except (FellOff, NotFinite) as error:
            self.fallen = True
            self.say("climber", f"fell off: {error}" if isinstance(error, FellOff) else str(error))
            return
        self.machine.measure()
        self.stamp += self.period
        self.stepped_at = WALL_CLOCK.now().nanoseconds
        self.publish_state()

    # What it tells

    def publish_state(self) -> None:
        """Publish all that a robot would tell, and the margins."""
        self.topics.publish(self.machine, self.stamp, self.asked)
        load = self.machine.plant.wheel_load(self.machine.state)
        self.margins.publish(*self.machine.margins(), load, self.stamp)

    def diagnose(self) -> None:
        """Publish troubles and values, and how near to slipping and tipping it has been."""
        super().diagnose()
        self.margins.diagnose()

    def values(self) -> dict[str, object]:
        """Tell diagnostics how it goes."""
        return {
            "time [s]": self.stamp * 1e-9,
            "suction pressure [Pa]": self.machine.pressure,
            "side slip [m/s]": float(self.machine.state.side_slip),
            "paused": self.paused,
        }


def main() -> None:
    """Run the node."""
    run(PlantSimulator)
