r"""A driver whose robot is in MuJoCo, not in our simulator: the same topics, other physics.

    python examples/mujoco_driver.py --ros-args --params-file config/climber.yaml \
        -p simulated_time:=true -p locomotion:=four_wheeled -p wheel_inertia:=2.0e-4

It takes the parameters of plant_simulator, and has its place beside planner and controller: in
lock-step with `simulated_time`, as docs/hardware.md tells, else on the wall clock. `--record
FILE.gif` films the run. It needs `pip install mujoco`, and for the film Pillow and OpenGL.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco_climber import MujocoClimber
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Torques
from climber_uk.messages import reading, writing
from climber_uk.messages.topics import CLOCK, JOINTS, ODOMETRY, PLANT, PRESSURE, TORQUES, TRUTH
from climber_uk.ros import plant_parts
from climber_uk.ros.running import PUBLISH_PERIOD, WALL_CLOCK, ClimberNode, Throttle, run
from climber_uk.simulation.inputs import FellOff
from climber_uk.simulation.options import SimulationOptions

ASK_AGAIN = 0.2  # [s] of the wall clock, after which an odometry is published again
FILM_PERIOD, FILM_SIZE = SECOND // 5, (240, 320)  # [ns] between two pictures; their pixels


class Film:
    """Pictures of a climber, seen from in front of the wall; an animated GIF at the end."""

    def __init__(self, climber: MujocoClimber, file: Path) -> None:
        self.climber, self.file, self.pictures = climber, file, list[Any]()
        self.is_due = Throttle(FILM_PERIOD)
        self.renderer = mujoco.Renderer(climber.model, *FILM_SIZE)
        self.camera = mujoco.MjvCamera()
        self.camera.distance, self.camera.azimuth, self.camera.elevation = 2.0, 90.0, -60.0

    def take(self, stamp: int) -> None:
        """Take a picture, if one is due at `stamp` [ns]."""
        if self.is_due(stamp):
            self.camera.lookat[:] = self.climber.data.qpos[:3]
            self.renderer.update_scene(self.climber.data, self.camera)
            self.pictures.append(self.renderer.render().copy())

    def save(self) -> None:
        """Write the file."""
        from PIL import Image  # it comes with matplotlib

        first, *others = map(Image.fromarray, self.pictures)
        time = FILM_PERIOD // 1_000_000
        first.save(self.file, save_all=True, append_images=others, duration=time, loop=0)


class MujocoDriver(ClimberNode):
    """The node: what it publishes, and which torque moves it on."""

    def __init__(self, film: Path | None = None) -> None:
        super().__init__(PLANT)
        plant_parts.declare(self.parameters)
        self.parameters.refuse_unknown("the paper's climber, at rest")
        self.options = self.parameters.read(SimulationOptions)
        parts = plant_parts.parts(self.parameters)
        self.period = round(self.options.control_period * SECOND)
        self.climber = MujocoClimber(parts, self.options.initial_state, self.options.control_period)
        self.film = Film(self.climber, film) if film else None
        self.is_simulated, self.has_fallen = self.options.simulated_time, False
        self.takes_speeds = parts.motors.take_speeds
        self.command = np.zeros(2)  # right, left
        self.commanded_at = 0  # [ns] of its odometry
        # a stamp of 0 would mean that there is no time yet
        self.origin = SECOND if self.is_simulated else self.get_clock().now().nanoseconds
        self.stamp = self.origin  # [ns]
        self.told_at = 0  # [ns] of the steady clock

        self.odometry = self.publisher(Odometry, ODOMETRY)
        self.truth = self.publisher(Odometry, TRUTH)
        self.joints = self.publisher(JointState, JOINTS)
        self.pressure = self.publisher(FluidPressure, PRESSURE)
        self.is_due = Throttle(PUBLISH_PERIOD)
        self.subscription(JointState, TORQUES, self.on_torques)
        self.start_diagnostics(dict, alone_on=(ODOMETRY, TORQUES))
        if self.is_simulated:
            self.clock = self.publisher(Clock, CLOCK)
            self.create_timer(ASK_AGAIN, self.ask_again, clock=WALL_CLOCK)
        else:
            self.create_timer(self.options.control_period, self.follow_clock)
        self.tell()

    # Commands

    def on_torques(self, message: JointState) -> None:
        """Obey a command; in lock-step go on by a period if it answers the last odometry."""
        stamp = reading.nanoseconds(message.header.stamp)
        try:
            self.command[:] = self.fit(message, stamp)
            self.report(TORQUES, "")
        except ValueError as error:
            self.report(TORQUES, "refused, zero instead", str(error))
            self.command[:] = 0.0
        self.commanded_at = stamp
        if self.is_simulated and stamp == self.asked:
            self.go_on()
            self.tell()

    def fit(self, message: JointState, stamp: int) -> Torques:
        """Command of a message, torques or rates; `ValueError` if it is none."""
        values = message.velocity if self.takes_speeds else message.effort
        fields = reading.JointFields(*divmod(stamp, SECOND), values, message.name)
        what: reading.Told = "velocities" if self.takes_speeds else "efforts"
        return reading.wheel_torques(fields, self.names.wheels, what)

    def follow_clock(self) -> None:
        """Let the time pass that has passed on the wall clock."""
        now = self.get_clock().now().nanoseconds
        while self.stamp + self.period <= now and not self.has_fallen:
            if self.stamp - self.commanded_at > self.options.command_timeout * SECOND:
                self.command[:] = 0.0
            self.go_on()
            self.tell()

    def go_on(self) -> None:
        """Go on by a period under the command."""
        try:
            for _ in range(0 if self.has_fallen else self.options.steps):
                self.climber.advance(self.command)
        except FellOff as fall:
            self.has_fallen = True
            self.report("climber", f"fell off: {fall}")
            return
        self.climber.measure()
        self.stamp += self.period

    # Outputs

    @property
    def asked(self) -> int:
        """Stamp of the latest odometry [ns], which a command is to answer."""
        number, _ = self.climber.odometer.latest()
        return self.origin + number * self.period

    def ask_again(self) -> None:
        """Publish an odometry again that nothing has answered: it may be lost."""
        if WALL_CLOCK.now().nanoseconds - self.told_at > ASK_AGAIN * SECOND:
            self.tell()

    def tell(self) -> None:
        """Publish the odometry, which is to be answered, then the time, then the rest."""
        if self.has_fallen:
            return
        climber, names, self.told_at = self.climber, self.names, WALL_CLOCK.now().nanoseconds
        frames = names.odom_frame, names.base_frame
        _, measured = climber.odometer.latest()
        self.odometry.publish(writing.odometry(measured, self.asked, *frames))
        if self.is_simulated:
            self.clock.publish(Clock(clock=writing.time(self.stamp)))
        self.truth.publish(writing.odometry(climber.state, self.stamp, *frames))
        joints = JointState(name=names.wheels.all)
        joints.header.stamp = writing.time(self.stamp)
        joints.position = names.wheels.rates(*writing.left_right(climber.angles))
        joints.velocity = names.wheels.rates(*writing.left_right(climber.rates))
        joints.effort = names.wheels.torques(*writing.left_right(climber.torques))
        self.joints.publish(joints)
        if self.is_due(self.stamp):
            pressure = FluidPressure(fluid_pressure=float(climber.pressure))
            pressure.header.stamp = writing.time(self.stamp)
            self.pressure.publish(pressure)
        if self.film is not None:
            self.film.take(self.stamp)

    def destroy_node(self) -> None:
        """Save the film, and end."""
        if self.film is not None:
            self.film.save()
        super().destroy_node()


def drivers(record: Path | None = None) -> Sequence[ClimberNode]:
    """The node of one climber."""
    return [MujocoDriver(record)]


if __name__ == "__main__":
    film = {"type": Path, "metavar": "FILE.gif", "help": "film the run into a new file"}
    run(drivers, __doc__, {"--record": film})
