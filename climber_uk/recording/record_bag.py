"""The recorder: topics of the graph into a rosbag2 directory, on machines without rosbag2.

    record_bag [--output DIR] [--storage mcap|sqlite3] [--topics A B …] [--exclude C …]

Log times are those of reception on the system clock, in simulated time too, as in rosbag2; but they
never go back, if that is set back.
"""

import os
import sys
import time
from argparse import ArgumentTypeError, Namespace
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import rclpy
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.utilities import remove_ros_args
from rclpy.validate_topic_name import validate_topic_name

from climber_uk.bags.bag_writer import NEVER, BagWriter
from climber_uk.bags.log_clock import LogClock
from climber_uk.bags.storage import STORAGES, is_known
from climber_uk.recording.offered_qos import QUEUE_DEPTH, is_compatible, request_for, to_metadata
from climber_uk.ros.leaving import leave
from climber_uk.ros.transport import use_udp
from climber_uk.system.command_line import Parser, in_words
from climber_uk.system.signals import on_end

FLUSH_PERIOD = 0.5  # [s] of messages that a killed recorder loses
DISCOVERY_PERIOD = 0.2  # [s]
TAKE_PERIOD = 0.01  # [s]
GRACE = 0.1  # [s] after a stop, for messages on their way
REPAIR = 3.5  # [s] in which lost messages are sent again: Fast DDS offers them every 3 s
LATCHED = DurabilityPolicy.TRANSIENT_LOCAL
A_FEW = 5  # messages of a topic that is not published all the time
RCLPY = {"3": "humble", "4": "iron", "7": "jazzy", "9": "kilted"}  # distributions by its version


@dataclass
class RecordedTopic:
    """A topic that is recorded, with one of the types that publishers may give it."""

    subscription: Subscription
    type_name: str
    lost: int = 0  # messages, by the middleware's count
    overflowed: bool = False  # the queue was full, so that others may be lost
    published: int = 0  # [ns] log time at which the latest message was published


class BagRecorder(Node):
    """Subscribes topics as they appear and records what arrives, without decoding it.

    It takes what has arrived a hundred times a second and is not spun: an executor that is woken
    by every message takes several times the CPU, at the expense of the nodes that are recorded.
    """

    def __init__(self, options: Namespace) -> None:
        super().__init__("record_bag", start_parameter_services=False)
        self.wanted = {self.resolve_topic_name(name) for name in options.topics}
        self.unwanted = {self.resolve_topic_name(name) for name in options.exclude}
        self.recorded: dict[str, RecordedTopic] = {}
        self.refused: set[tuple[str, str]] = set()  # topics with types that are not recorded
        self.clock = LogClock()
        self.stopped = 0  # [ns] steady clock when asked to stop; 0: not yet
        self.stop_time = 0  # [ns] log time of that
        # Before there is a bag that has to be closed. Our own handlers: those of rclpy would cut
        # off what has arrived and is not yet recorded, and KeyboardInterrupt, a second one too,
        # might come in the middle of a write.
        on_end(self.stop)
        self.bag = BagWriter(options.output, options.storage, running_distro())

    def run(self) -> None:
        """Record until `stop` is called, and then what had been published by that time."""
        next_discovery = next_flush = 0.0
        is_behind = True  # whether messages from before the stop still come in
        while not self.stop_time or is_behind:
            now = time.monotonic()
            if now >= next_discovery:
                self.discover()
                next_discovery = now + DISCOVERY_PERIOD
            if now >= next_flush:
                self.report_losses()
                self.bag.flush()
                next_flush = now + FLUSH_PERIOD
            was_asked = bool(self.stopped)
            time.sleep(GRACE if was_asked else TAKE_PERIOD)
            self.update_clock()
            oldest = self.take()
            is_behind = not was_asked or oldest <= self.stop_time or self.misses_some()
        self.report_losses()

    def discover(self) -> None:
        """Subscribe new topics, and adapt the subscriptions to their publishers' offers.

        Of a node's topics the latched ones come last: each node learns of subscriptions in their
        order, so that one that has sent its latched message has heard of all others.
        """
        found = [topic for topic in self.get_topic_names_and_types() if self.is_wanted(topic[0])]
        for name, types in sorted(found, key=self.is_new_and_latched):
            if name not in self.bag:  # else its type is settled
                self.choose_type(name, types)
            if name in self.recorded:
                self.refuse_others(name, types)
                if offers := self.offers(name, self.recorded[name].type_name):
                    self.introduce(name)
                    self.adapt(name, offers)

    def is_new_and_latched(self, topic: tuple[str, list[str]]) -> bool:
        """Whether a topic, given with its types, is latched and not subscribed yet."""
        ends = [] if topic[0] in self.recorded else self.get_publishers_info_by_topic(topic[0])
        return any(end.qos_profile.durability == LATCHED for end in ends)

    def is_wanted(self, name: str) -> bool:
        """Whether to record a topic: one of `--topics`, or without these any that is not hidden."""
        hidden = "/_" in name
        return name not in self.unwanted and (name in self.wanted if self.wanted else not hidden)

    def offers(self, name: str, type_name: str) -> list[QoSProfile]:
        """QoS profiles that a topic's publishers of one type offer."""
        publishers = self.get_publishers_info_by_topic(name)
        return [end.qos_profile for end in publishers if end.topic_type == type_name]

    def choose_type(self, name: str, types: Sequence[str]) -> None:
        """Subscribe a topic, also without publishers, with the type that most publishers have."""
        known = [type_name for type_name in types if find_message_class(type_name)]
        if not known:
            self.get_logger().warning(f"not recording {name}: unknown type {', '.join(types)}")
            self.unwanted.add(name)
            return
        offers = {type_name: self.offers(name, type_name) for type_name in known}
        chosen = max(known, key=lambda type_name: len(offers[type_name]))
        present = self.recorded.get(name)
        if present is None or (present.type_name != chosen and offers[chosen]):
            self.get_logger().info(f"recording {name} [{chosen}]")
            self.subscribe(name, chosen, request_for(offers[chosen]))

    def refuse_others(self, name: str, types: Sequence[str]) -> None:
        """Warn once of each type that is not recorded: a topic in a bag has one type."""
        recorded = self.recorded[name].type_name
        for type_name in set(types) - {recorded}:
            if (name, type_name) not in self.refused:
                self.refused.add((name, type_name))
                self.get_logger().warning(
                    f"not recording {type_name} on {name}, which is recorded as {recorded}"
                )

    def subscribe(self, name: str, type_name: str, request: QoSProfile) -> None:
        """Subscribe a topic, replacing its present subscription."""
        present = self.recorded.get(name)
        if present is not None:
            self.count_losses(name)
            self.destroy_subscription(present.subscription)
        subscription = self.create_subscription(
            find_message_class(type_name),
            name,
            lambda _: None,  # never called: see `take`
            request,
            raw=True,
            # the default ones warn of what `adapt` mends
            event_callbacks=SubscriptionEventCallbacks(
                message_lost=lambda _: None,  # likewise: see `count_losses`
                use_default_callbacks=False,
            ),
        )
        lost = present.lost if present else 0
        self.recorded[name] = RecordedTopic(subscription, type_name, lost)

    def adapt(self, name: str, offers: Sequence[QoSProfile]) -> None:
        """Subscribe a topic again if one of its publishers cannot serve the subscription.

        Also if all can serve a stricter one, which brings what a latching publisher sent before;
        but not once messages have arrived, as some would come twice.
        """
        recorded, request = self.recorded[name], request_for(offers)
        present = recorded.subscription.qos_profile
        served = all(is_compatible(offer, present) for offer in offers)
        if not served or (request != present and not self.bag.count(name)):
            self.subscribe(name, recorded.type_name, request)

    def introduce(self, name: str) -> None:
        """Add a topic to the bag, with its publishers' offers, unless the bag has it."""
        if name not in self.bag:
            type_name = self.recorded[name].type_name
            offers = [to_metadata(qos) for qos in self.offers(name, type_name)]
            self.bag.add_topic(name, type_name, offers)

    def update_clock(self) -> None:
        """Warn if the system clock was set back, and find the log time of a stop."""
        step = self.clock.look()
        if step < 0:
            self.get_logger().warning(
                f"the system clock was set back by {-step / 1e9:.3f} s: log times go on as before"
            )
        if self.stopped and not self.stop_time:
            self.stop_time = self.clock.at(self.stopped)

    def take(self) -> int:
        """Record all messages that have arrived; return the oldest of their log times [ns]."""
        oldest = NEVER
        for name, recorded in self.recorded.items():
            handle, taken_now = recorded.subscription.handle, 0
            with handle:
                take = partial(handle.take_message, recorded.subscription.msg_type, True)
                while taken := take():
                    data, info = taken
                    taken_now += 1
                    received = info["received_timestamp"] or time.time_ns()
                    shift = self.clock.shift(received)
                    log_time = received + shift
                    published = (info["source_timestamp"] or received) + shift
                    oldest = min(oldest, log_time)
                    recorded.published = published
                    # else a bag would end with answers to messages that are not in it
                    if not self.stop_time or min(log_time, published) <= self.stop_time:
                        self.introduce(name)
                        self.bag.write(name, log_time, published, data)
            recorded.overflowed |= taken_now >= QUEUE_DEPTH
        return oldest

    def misses_some(self) -> bool:
        """Whether messages from before the stop may still come.

        Reliable messages come in order: while one is sent again, those after it wait. So a topic
        that was published shortly before the stop is complete once a message from after it has
        come. Topics that are latched, or had a few messages only, are not waited for.
        """
        if self.clock.at(time.monotonic_ns()) > self.stop_time + REPAIR * 1e9:
            return False
        return any(
            self.stop_time - REPAIR * 1e9 < recorded.published <= self.stop_time
            and recorded.subscription.qos_profile.reliability == ReliabilityPolicy.RELIABLE
            and recorded.subscription.qos_profile.durability == DurabilityPolicy.VOLATILE
            and self.bag.count(name) > A_FEW
            and self.count_publishers(name)
            for name, recorded in self.recorded.items()
        )

    def count_losses(self, name: str) -> int:
        """Add the middleware's count of a topic's lost messages; return how many are new."""
        recorded, new = self.recorded[name], 0
        for handler in recorded.subscription.event_handlers:
            handler._ready_to_take_data = True  # no executor sets it: see `take`
            if status := handler.take_data():
                new += status.total_count_change
        recorded.lost += new
        return new

    def report_losses(self) -> None:
        """Warn of topics that lose messages, and write the counts into the bag's metadata."""
        for name, recorded in self.recorded.items():
            is_first = not recorded.lost
            new = self.count_losses(name)
            if new and is_first:
                self.get_logger().warning(f"messages on {name} are lost; metadata.yaml counts them")
            if recorded.lost:
                self.bag.custom_data[f"messages lost on {name}"] = str(recorded.lost)
            if recorded.overflowed:
                self.bag.custom_data[f"queue full on {name}"] = "more may be lost"

    def stop(self, *_: object) -> None:
        """Signal handler: finish once all is recorded that was published before the first call."""
        self.stopped = self.stopped or time.monotonic_ns()


def running_distro() -> str:
    """Name of the ROS distribution: ROS_DISTRO, else by the version of rclpy."""
    with suppress(PackageNotFoundError):
        major = version("rclpy").split(".")[0]
        return os.environ.get("ROS_DISTRO") or RCLPY.get(major, "unknown")
    return os.environ.get("ROS_DISTRO") or "unknown"


def find_message_class(type_name: str) -> type[Any] | None:
    """Class of a message type; None if it is not installed, or no definition is known for a bag."""
    package, kind, name = type_name.split("/")
    try:
        message_class = getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError):
        return None
    return message_class if is_known(type_name) else None


def parse(arguments: Sequence[str]) -> Namespace:
    """Options of the command line."""
    parser = Parser("record_bag", "Record topics into a rosbag2 directory.")
    default = Path(datetime.now().strftime("climber_bag_%Y_%m_%d-%H_%M_%S"))
    parser.add_argument("--output", "-o", type=Path, default=default, help="a new directory")
    parser.add_argument("--storage", "-s", choices=STORAGES, default="mcap")
    for option, meaning in {"--topics": "default: all", "--exclude": "not these"}.items():
        parser.add_argument(option, nargs="+", type=topic_name, default=[], help=meaning)
    return parser.arguments(arguments)


def topic_name(name: str) -> str:
    """`name` if it is valid for a topic, for `argparse`; raises `ArgumentTypeError`."""
    try:
        validate_topic_name(name)
    except InvalidTopicNameException:
        raise ArgumentTypeError(f"{name!r} is no name of a topic") from None
    return name


def record(recorder: BagRecorder) -> None:
    """Record until a signal to end."""
    try:
        recorder.run()
    finally:
        recorder.bag.close()
        recorder.get_logger().info(f"{recorder.bag.message_count} messages in {recorder.bag.path}")
        for what, how_much in recorder.bag.custom_data.items():
            recorder.get_logger().warning(f"{what}: {how_much}")


def main() -> None:
    """Run the recorder."""
    options = parse(remove_ros_args(sys.argv)[1:])
    use_udp()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    recorder, status = None, 0
    try:
        recorder = BagRecorder(options)
        record(recorder)
    except KeyboardInterrupt:
        pass
    except OSError as error:
        print(f"record_bag: {in_words(error)}", file=sys.stderr)
        status = 1
    leave(status, recorder)
    sys.exit(status)


if __name__ == "__main__":
    main()
