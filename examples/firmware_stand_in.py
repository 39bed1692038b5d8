"""A motor board for examples/minimal_driver.py, with a simulated climber behind it.

It opens a pseudo-terminal, prints where, and speaks there the protocol of docs/hardware.md. It has
the parameters of plant_simulator (no errors of sensors but rounding), and those of `Board`. With
`simulated_time` a control period passes with each command, and /clock tells the board's time. With
`motors: velocity` it takes speeds.
"""

import math
import os
import pty
import select
import signal
import sys
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path

import numpy as np
import rclpy
from minimal_driver import MOUNTED, packed, unpacked
from rclpy._rclpy_pybind11 import RCLError
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from climber_uk.mechanics import SECOND
from climber_uk.messages import writing
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.ros import plant_parts
from climber_uk.ros.leaving import leave
from climber_uk.ros.plant_time import ASK_AGAIN, TICK
from climber_uk.ros.running import ClimberNode, Throttle
from climber_uk.ros.transport import use_udp
from climber_uk.simulation.inputs import FellOff
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import SimulatedRobot

CUT, LIMITED = 1, 2  # flags
SIGNS = np.array(MOUNTED)


@parameters
class Board:
    """Motors, gears and encoders."""

    encoder_counts: int = parameter(4096, "", "counts in a turn of a wheel", at_least=4)
    motor_constant: float = parameter(0.025, "N m/A", "torque of a motor for a current", above=0)
    gear_ratio: float = parameter(50.0, "", "turns of a motor in a turn of its wheel", above=0)
    max_current: float = parameter(3.2, "A", "limit of each motor's current", above=0)
    watchdog_time: float = parameter(0.1, "s", "without a command that cuts currents", above=0)
    truth: str = parameter("", "", "CSV file for the true motion and torques; '': none")


class FirmwareStandIn(ClimberNode):
    """The board's program; pairs are left, right, as the motors turn."""

    def __init__(self) -> None:
        super().__init__("plant_simulator")
        self.parameters.declare(Board)
        plant_parts.declare(self.parameters)
        self.parameters.refuse_unknown()
        self.board = self.parameters.read(Board)
        self.options = self.parameters.read(SimulationOptions)
        parts = plant_parts.parts(self.parameters)
        self.robot = SimulatedRobot(parts, self.options.initial_state, self.options.control_period)
        self.torque = self.board.motor_constant * self.board.gear_ratio  # [N m] at a wheel for 1 A
        self.period = round(self.options.control_period * SECOND)
        self.time, self.commanded_at = SECOND, 0  # [ns] since the board was switched on
        self.commanded = np.zeros(2)  # [mA], or [counts/s] if it takes speeds
        self.flags, self.refused, self.rest = CUT, 0, b""
        self.takes_speeds = parts.motors.take_speeds
        self.count = 2 * math.pi / self.board.encoder_counts  # [rad]
        self.clock = self.publisher(Clock, "/clock") if self.options.simulated_time else None
        self.is_due = Throttle(TICK)
        self.port, self.line = pty.openpty()  # our end, and the one for the driver
        tty.setraw(self.line)
        os.set_blocking(self.port, False)

    def run(self, end: threading.Event) -> None:
        """Live until the end; raises `FellOff`."""
        print(f"device: {os.ttyname(self.line)}", flush=True)
        with Path(self.board.truth or os.devnull).open("w", buffering=1) as self.truth:
            print("time,x,y,heading,left_torque,right_torque", file=self.truth)
            self.tell()
            due = time.monotonic() + self.options.control_period
            while not end.is_set():
                if self.clock is not None:
                    self.in_lock_step()
                else:
                    due = self.on_the_wall_clock(due)

    def in_lock_step(self) -> None:
        """Step if a command comes, else ask again for one."""
        if self.listen(ASK_AGAIN):
            self.step()
        else:
            self.tell_time()
        self.tell()

    def on_the_wall_clock(self, due: float) -> float:
        """Step if it is `due` [s]; return when the next step is."""
        self.listen(due - time.monotonic())
        if time.monotonic() < due:
            return due
        self.step()
        self.tell()
        return due + self.options.control_period

    def listen(self, patience: float) -> bool:
        """Obey commands that arrive within `patience` [s]; whether there was any."""
        if not select.select([self.port], [], [], max(0.0, patience))[0]:
            return False
        *lines, self.rest = (self.rest[-100:] + os.read(self.port, 4096)).split(b"\n")
        before = self.refused
        for line in lines:
            try:
                left, right = unpacked(line, "V" if self.takes_speeds else "C")
            except ValueError:
                self.refused += 1
                continue
            self.commanded, self.commanded_at = np.array([left, right]), self.time
        return len(lines) > self.refused - before

    def step(self) -> None:
        """Let a control period pass."""
        cut = self.time - self.commanded_at > self.board.watchdog_time * SECOND
        self.commanded = np.zeros(2) if cut else self.commanded
        most = math.inf if self.takes_speeds else 1e3 * self.board.max_current
        within = np.clip(self.commanded, -most, most)
        limited = bool((within != self.commanded).any())
        self.flags = CUT * cut | LIMITED * limited
        unit = self.count if self.takes_speeds else 1e-3 * self.torque
        command = (unit * SIGNS * within)[::-1]
        for _ in range(self.options.steps):
            self.robot.advance(command)
        self.time += self.period

    def tell(self) -> None:
        """Send a frame, and write down the truth; what the driver does not read is lost."""
        counts = np.floor(SIGNS * self.robot.angles[::-1] / self.count).astype(int)
        currents = np.round(1e3 * SIGNS * self.robot.torques[::-1] / self.torque).astype(int)
        now = self.time // 1000 % 2**32
        numbers = (now, *counts, *currents, self.flags, self.refused)
        with suppress(BlockingIOError):
            os.write(self.port, packed(f"E {' '.join(map(str, numbers))}"))
        if self.is_due(self.time):
            self.tell_time()
        right, left = self.robot.torques
        row = (self.time / SECOND, *self.robot.state.pose, left, right)
        print(*(f"{number:.9f}" for number in row), sep=",", file=self.truth)

    def tell_time(self) -> None:
        """Publish the simulated time."""
        if self.clock is not None:
            self.clock.publish(Clock(clock=writing.time(self.time)))


def main() -> None:
    """Run the board until a signal to end."""
    end = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: end.set())
    board, status = None, 1
    try:
        use_udp()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        board = FirmwareStandIn()
        board.run(end)
        status = 0
    except (ValueError, OSError, RCLError) as error:
        print(f"firmware_stand_in: {error}", file=sys.stderr)
    except FellOff as fall:
        print(f"firmware_stand_in: the climber fell off: {fall}", file=sys.stderr)
    leave(status, board)
    sys.exit(status)


if __name__ == "__main__":
    main()
