"""What `climber watch` shows: how far a climber is, its speed, errors, margins, torques as bars."""

import math
import shutil
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from climber_uk.messages.topics import CONTROLLER, MARGINS, ODOMETRY, PARAMETERS, PROGRESS, TORQUES
from climber_uk.system.command_line import printable

ERROR = f"{CONTROLLER}/tracking_error"
HEARD = {
    PROGRESS: DiagnosticArray,
    ODOMETRY: Odometry,
    ERROR: Vector3Stamped,
    MARGINS[1]: Vector3Stamped,
    TORQUES: JointState,
    PARAMETERS: ParameterEvent,
}  # topics, and their types
STALE = 2.0  # [s] after which a message tells nothing any more
HALF = 20  # characters of a bar to one side
ALONE = 1.0  # [s] between lines where no terminal shows them
CLEAR, BELOW = "\x1b[K", "\x1b[J"  # the rest of a line, and what is below
WHY = "Its log says why; 'climber enable' goes on after a fault, or when disabled."
NOBODY = f"Nobody has told how far it is for {STALE:g} s: have the nodes ended?"


class Watched:
    """The last message of each topic of a climber, as long as it is new."""

    def __init__(self, node: Node) -> None:
        self._heard: dict[str, tuple[float, Any]] = {}
        last = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for name, kind in HEARD.items():
            qos = kept if name == PARAMETERS else last
            node.create_subscription(kind, name, partial(self._hear, name), qos)

    def _hear(self, name: str, message: Any) -> None:
        self._heard[name] = time.monotonic(), message

    def now(self) -> dict[str, Any]:
        """Messages by topic; parameters stay as they are."""
        then = time.monotonic() - STALE
        return {
            name: message
            for name, (at, message) in self._heard.items()
            if at > then or name == PARAMETERS
        }


class Screen:
    """Lines that are written over those of before; one now and then where it is no terminal."""

    def __init__(self) -> None:
        self.height = 0  # lines that are there
        self._after = 0.0  # [s] that the next one may be written

    def show(self, lines: list[str]) -> None:
        """Write the lines, as much of each as fits in."""
        lines = [printable(line) for line in lines]
        if not sys.stdout.isatty():
            if time.monotonic() >= self._after:
                self._after = time.monotonic() + ALONE
                print(lines[0], flush=True)
            return
        width = shutil.get_terminal_size().columns - 1
        up = f"\x1b[{self.height}A" if self.height else ""
        self.height = len(lines)
        shown = "".join(f"{line[:width]}{CLEAR}\n" for line in lines)
        print(f"{up}{shown}{BELOW}", end="", flush=True)


def progress(message: DiagnosticArray) -> tuple[str, str]:
    """State of a progress, and a line of all of it."""
    (status,) = message.status
    text = {pair.key: pair.value for pair in status.values}
    mode = text.pop("mode", "").replace("_", " ")
    value = {key: float(number) for key, number in text.items()}
    state = status.message
    if state == "waiting" and mode:
        state += f" (the controller: {mode})"
    said = [state, f"{value['done']:.2f} m done"]
    if math.isfinite(value["left"]):
        said += [f"{value['left']:.2f} m left", f"{value['time_left']:.0f} s"]
    if value["lap"]:
        said += [f"lap {value['lap']:.0f}", f"segment {value['segment']:.0f}"]
    return status.message, ", ".join(said)


def hint(message: DiagnosticArray) -> str:
    """What to do where the controller is what the planner waits for; else nothing."""
    return WHY if "(the controller: " in progress(message)[1] else ""


def lines(heard: Mapping[str, Any]) -> list[str]:
    """What to show of the messages by topic: – for what nobody tells."""
    limits = {
        parameter.name: parameter.value.double_value
        for parameter in (heard[PARAMETERS].new_parameters if PARAMETERS in heard else [])
    }
    limit = limits.get("max_wheel_torque", 0.0)
    return [
        progress(heard[PROGRESS])[1] if PROGRESS in heard else "planner  –",
        "speed    " + _said(heard, ODOMETRY, _speed),
        "error    " + _said(heard, ERROR, _error),
        "margins  " + _said(heard, MARGINS[1], _margins),
        *(_torques(heard[TORQUES], limit) if TORQUES in heard else ["torques  –"]),
        hint(heard[PROGRESS]) if PROGRESS in heard else NOBODY,
    ]


def _said(heard: Mapping[str, Any], name: str, words: Callable[[Any], str]) -> str:
    return words(heard[name]) if name in heard else "–"


def _speed(message: Odometry) -> str:
    twist = message.twist.twist
    return f"{twist.linear.x:7.3f} m/s, turning {twist.angular.z:7.3f} rad/s"


def _error(message: Vector3Stamped) -> str:
    along, across, heading = message.vector.x, message.vector.y, message.vector.z
    return f"{1e3 * along:8.2f} mm along the path, {1e3 * across:8.2f} mm across, {heading:.4f} rad"


def _margins(message: Vector3Stamped) -> str:
    slip, tip, load = message.vector.x, message.vector.y, message.vector.z
    return f"slip {slip:6.2f}, tip {tip:6.2f} (below 1 it slips, or tips over); load {load:.0f} N"


def _torques(message: JointState, limit: float) -> list[str]:
    """A bar for each wheel, of the limit [N m] if that is known, else of the largest torque."""
    whole = limit or max(map(abs, message.effort), default=0.0) or 1.0
    return [
        f"torque  {bar(effort / whole)} {effort:7.3f} N m {name}"
        for name, effort in zip(message.name, message.effort, strict=False)
    ]


def bar(share: float) -> str:
    """A bar to the left or to the right of the middle, for a share from -1 to 1."""
    if not math.isfinite(share):
        return f"{'?':^{2 * HALF + 1}}"
    block = "█" * round(HALF * min(1.0, abs(share)))
    return f"{block if share < 0 else '':>{HALF}}|{block if share > 0 else '':<{HALF}}"
