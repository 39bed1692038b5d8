"""Drive a climber from a terminal: start, pause, resume, slower, back, and how far it is.

  climber start | stop | pause | resume | retreat     on its path
  climber speed 0.5                                   a share of the planned speed, 0.01 to 1
  climber enable | disable                            the controller
  climber push 20 0                                   the simulated climber, by forces x, y [N]
  climber status                                      how far it is, once
  climber watch                                       that, speed, errors, margins and torques,
                                                      until it is done, or Ctrl-C

The status is 0 if it is done, 1 if it is refused, 3 if nobody answers.
"""

import os
import sys
import time
from argparse import ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.srv import SetParameters
from rclpy.exceptions import InvalidNamespaceException
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_namespace import validate_namespace
from std_srvs.srv import SetBool, Trigger

from climber_uk.messages import writing
from climber_uk.messages.topics import CONTROLLER, PLANNER, PROGRESS, PUSH
from climber_uk.operating import watching
from climber_uk.ros.leaving import leave
from climber_uk.ros.transport import use_udp
from climber_uk.system.command_line import Parser, between, printable
from climber_uk.system.signals import Interrupted, on_end

REFUSED, SILENT = 1, 3  # exit statuses
PERIOD = 0.05  # [s] in which it is looked for what is waited for
REDRAWN = 0.1  # [s] after which what is watched is shown anew
PUSHES = 10  # messages, over half a second: a simulated push lasts as long as it is told


class NoAnswerError(RuntimeError):
    """Nobody has answered in time."""


class Operator:
    """Calls services and hears topics of the climber in a namespace."""

    def __init__(self, node: Node, timeout: float) -> None:
        self.node, self.timeout = node, timeout

    def wait(self, condition: Callable[[], Any], what: str) -> None:
        """Spin until a condition holds; raises `NoAnswerError`."""
        until = time.monotonic() + self.timeout
        while not condition():
            rclpy.spin_once(self.node, timeout_sec=PERIOD)
            if time.monotonic() > until:
                raise self.no_answer(what)

    def no_answer(self, what: str) -> NoAnswerError:
        """The error that nobody has answered in time."""
        where = f"in ROS domain {os.environ.get('ROS_DOMAIN_ID', '0')}"
        return NoAnswerError(f"nobody answers: {what} ({where}, within {self.timeout:g} s)")

    def call(self, kind: Any, name: str, request: Any) -> Any:
        """Response of a service."""
        client, about = self.node.create_client(kind, name), self.node.resolve_service_name(name)
        self.wait(client.service_is_ready, f"service {about}")
        future = client.call_async(request)
        self.wait(future.done, f"service {about}")
        return future.result()

    def trigger(self, name: str) -> tuple[bool, str]:
        """Whether a service of the planner was done, and what it said."""
        response = self.call(Trigger, f"{PLANNER}/{name}", Trigger.Request())
        return response.success, response.message

    def switch(self, name: str, on: bool) -> tuple[bool, str]:
        """The same of a service that switches."""
        response = self.call(SetBool, name, SetBool.Request(data=on))
        return response.success, response.message

    def set_speed(self, speed: float) -> tuple[bool, str]:
        """Go on at a share of the planned speed."""
        asked = SetParameters.Request()
        asked.parameters = [Parameter("speed", value=speed).to_parameter_msg()]
        (result,) = self.call(SetParameters, f"{PLANNER}/set_parameters", asked).results
        return result.successful, result.reason or f"speed {speed:g}"

    def push(self, x: float, y: float) -> tuple[bool, str]:
        """Push the simulated climber by forces [N] along x and y of the wall, for half a second."""
        publisher = self.node.create_publisher(WrenchStamped, PUSH, 10)
        self.wait(publisher.get_subscription_count, f"topic {publisher.topic_name}")
        for force in [(x, y)] * PUSHES + [(0.0, 0.0)]:
            publisher.publish(writing.wrench([*force, 0.0], 0, "odom"))
            until = time.monotonic() + PERIOD
            while time.monotonic() < until:
                rclpy.spin_once(self.node, timeout_sec=PERIOD)
        return True, f"pushed by ({x:g}, {y:g}) N"

    def status(self) -> tuple[bool, str]:
        """How far it is."""
        heard: list[DiagnosticArray] = []
        subscription = self.node.create_subscription(DiagnosticArray, PROGRESS, heard.append, 10)
        self.wait(lambda: heard, f"topic {subscription.topic_name}")
        return True, f"{watching.progress(heard[-1])[1]}\n{watching.hint(heard[-1])}".rstrip()

    def watch(self) -> tuple[bool, str]:
        """Show what it does until its path is done."""
        watched, screen = watching.Watched(self.node), watching.Screen()
        topic = self.node.resolve_topic_name(PROGRESS)
        self.wait(lambda: PROGRESS in watched.now(), f"topic {topic}")
        last = time.monotonic()
        while True:
            heard = watched.now()
            screen.show(watching.lines(heard))
            if PROGRESS in heard:
                last = time.monotonic()
                if watching.progress(heard[PROGRESS])[0] == "done":
                    return True, ""
            elif time.monotonic() > last + self.timeout:
                raise self.no_answer(f"topic {topic}")
            time.sleep(REDRAWN)  # the last message of each topic is kept meanwhile
            for _ in watching.HEARD:
                rclpy.spin_once(self.node, timeout_sec=0.0)


DO: dict[str, Callable[[Operator, list[float]], tuple[bool, str]]] = {
    "start": lambda operator, _: operator.trigger("start"),
    "stop": lambda operator, _: operator.trigger("stop"),
    "retreat": lambda operator, _: operator.trigger("retreat"),
    "pause": lambda operator, _: operator.switch(f"{PLANNER}/pause", True),
    "resume": lambda operator, _: operator.switch(f"{PLANNER}/pause", False),
    "enable": lambda operator, _: operator.switch(f"{CONTROLLER}/enable", True),
    "disable": lambda operator, _: operator.switch(f"{CONTROLLER}/enable", False),
    "speed": lambda operator, values: operator.set_speed(*values),
    "push": lambda operator, values: operator.push(*values),
    "status": lambda operator, _: operator.status(),
    "watch": lambda operator, _: operator.watch(),
}
NUMBERS = {"speed": 1, "push": 2}  # that a verb takes; others take none


def parse() -> Namespace:
    """Options of the command line; shells complete it where argcomplete is installed."""
    parser = Parser("climber", __doc__)
    parser.formatter_class = RawDescriptionHelpFormatter
    parser.add_argument("verb", choices=DO, help="what it is to do")
    parser.add_argument("values", nargs="*", type=between(-1e6, 1e6), help="of speed and push")
    parser.add_argument(
        "--namespace", type=_namespace, default="", help="of the climber (default: none)"
    )
    parser.add_argument(
        "--timeout",
        type=between(0.1, 3600.0),
        default=10.0,
        help="how long an answer is waited for [s] (default: 10)",
    )
    with suppress(ImportError):
        import argcomplete

        argcomplete.autocomplete(parser)
    options = parser.arguments()
    number = NUMBERS.get(options.verb, 0)
    if len(options.values) != number:
        parser.error(f"{options.verb} takes {number} number(s), not {len(options.values)}")
    return options


def _namespace(name: str) -> str:
    try:
        validate_namespace("/" + (bare := name.strip("/")))
    except InvalidNamespaceException:
        raise ArgumentTypeError(f"{name!r} is no namespace") from None
    return bare


def main() -> None:
    """Do what the command line says."""
    options = parse()
    node = None
    try:
        on_end(_interrupt)
        use_udp()
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        node = Node("climber", namespace=options.namespace)
        is_done, said = DO[options.verb](Operator(node, options.timeout), options.values)
        print(printable(said), file=sys.stdout if is_done else sys.stderr)
        status = 0 if is_done else REFUSED
    except NoAnswerError as error:
        print(f"climber: {error}", file=sys.stderr)
        status = SILENT
    except (KeyError, ValueError) as error:  # others publish there, too
        print(printable(f"{PROGRESS} is not what it should be ({error})"))
        status = REFUSED
    except Interrupted:
        print()
        status = 0
    leave(status, node)
    sys.exit(status)


def _interrupt(*_: object) -> None:
    raise Interrupted
