"""The recorder: topics of the graph into a rosbag2 directory, on machines without rosbag2.

    record_bag [--output DIR] [--storage mcap|sqlite3] [--topics A B …] [--exclude C …]

Log times are those of reception on the system clock, in simulated time too, as in rosbag2.
"""

import signal
import sys
import time
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.utilities import remove_ros_args
from rclpy.validate_topic_name import validate_topic_name

from climber_uk.analysis.bag_writer import NEVER, BagWriter
from climber_uk.analysis.storage import STORAGES, Qos, is_known
from climber_uk.nodes.transport import use_udp

FLUSH_PERIOD = 0.5  # [s] a recorder that is killed loses what it received within this time
DISCOVERY_PERIOD = 0.2  # [s]
TAKE_PERIOD = 0.01  # [s]
GRACE = 0.1  # [s] for what was on its way when the stop came
REPAIR = 3.5  # [s] in which what was lost is sent again: Fast DDS offers it every 3 s
A_FEW = 5  # messages of a topic that is not published all the time
QUEUE_DEPTH = 5000  # messages of one topic that may wait: seconds, even at 1 kHz


class BagRecorder(Node):
    """Subscribes topics as they appear and records what arrives, without decoding it.

    It takes what has arrived a hundred times a second and is not spun: an executor that is woken
    by every message takes several times the CPU, and that from those who are recorded.
    """

    def __init__(self, options: Namespace) -> None:
        super().__init__("record_bag", start_parameter_services=False)
        self.wanted = {self.resolve_topic_name(name) for name in options.topics}
        self.unwanted = {self.resolve_topic_name(name) for name in options.exclude}
        self.recorded: dict[str, Subscription] = {}
        self.types: dict[str, str] = {}  # of the recorded topics
        self.bag = BagWriter(options.output, options.storage)
        self.heard: dict[str, int] = {}  # [ns] when the latest message of a topic was published
        self.stop_time = 0  # [ns] system clock; 0: not asked to stop

    def run(self) -> None:
        """Record until asked to stop, and then what had been sent or had arrived by then."""
        next_discovery = next_flush = 0.0
        is_behind = True  # whether messages from before the stop still come in
        while not self.stop_time or is_behind:
            now = time.monotonic()
            if now >= next_discovery:
                self.discover()
                next_discovery = now + DISCOVERY_PERIOD
            if now >= next_flush:
                self.bag.flush()
                next_flush = now + FLUSH_PERIOD
            was_asked = bool(self.stop_time)
            time.sleep(GRACE if was_asked else TAKE_PERIOD)
            oldest = self.take()
            is_behind = not was_asked or oldest <= self.stop_time or self.misses_some()

    def discover(self) -> None:
        """Record new topics, and follow what the publishers of the recorded ones offer."""
        for name, types in self.get_topic_names_and_types():
            if not self.is_wanted(name):
                continue
            if name not in self.recorded:
                self.start_recording(name, types)
            elif offers := self.offers(name):
                self.introduce(name, types[0])
                self.adapt(name, types[0], offers)

    def is_wanted(self, name: str) -> bool:
        """Whether to record a topic: one of those asked for, else any that is not hidden."""
        hidden = "/_" in name
        return name not in self.unwanted and (name in self.wanted if self.wanted else not hidden)

    def offers(self, name: str) -> list[QoSProfile]:
        """The profiles that the publishers of a topic offer."""
        return [publisher.qos_profile for publisher in self.get_publishers_info_by_topic(name)]

    def start_recording(self, name: str, types: Sequence[str]) -> None:
        """Subscribe a topic, even if nobody publishes it yet."""
        if len(types) > 1 or find_message_class(types[0]) is None:
            self.get_logger().warning(f"not recording {name}: unknown type {', '.join(types)}")
            self.unwanted.add(name)
        else:
            self.get_logger().info(f"recording {name} [{types[0]}]")
            self.subscribe(name, types[0], request_for(self.offers(name)))

    def subscribe(self, name: str, type_name: str, request: QoSProfile) -> None:
        """Subscribe a topic, in place of its present subscription."""
        if name in self.recorded:
            self.destroy_subscription(self.recorded[name])
        self.types[name] = type_name
        self.recorded[name] = self.create_subscription(
            find_message_class(type_name),
            name,
            lambda _: None,  # never called: see `take`
            request,
            raw=True,
            # the default ones warn of what `adapt` mends
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

    def adapt(self, name: str, type_name: str, offers: Sequence[QoSProfile]) -> None:
        """Subscribe a topic again if one of its publishers cannot serve the subscription.

        Likewise if all could serve a stricter one, which brings what a latching publisher sent
        before. Once messages have arrived it would bring some of them twice, so then not.
        """
        present, request = self.recorded[name].qos_profile, request_for(offers)
        served = all(is_compatible(offer, present) for offer in offers)
        if not served or (request != present and not self.bag.count(name)):
            self.subscribe(name, type_name, request)

    def introduce(self, name: str, type_name: str) -> None:
        """Enter a topic into the bag, once its publishers' offers are known."""
        if name not in self.bag:
            self.bag.add_topic(name, type_name, [to_metadata(qos) for qos in self.offers(name)])

    def take(self) -> int:
        """Record all that has arrived; return the oldest of its log times [ns]."""
        oldest = NEVER
        for name, subscription in self.recorded.items():
            with subscription.handle:
                take = partial(subscription.handle.take_message, subscription.msg_type, True)
                while taken := take():
                    data, info = taken
                    log_time = info["received_timestamp"] or time.time_ns()
                    published = info["source_timestamp"] or log_time
                    oldest = min(oldest, log_time)
                    self.heard[name] = published
                    # else a bag would end with answers to what is no longer in it
                    if not self.stop_time or min(log_time, published) <= self.stop_time:
                        self.introduce(name, self.types[name])
                        self.bag.write(name, log_time, published, data)
        return oldest

    def misses_some(self) -> bool:
        """Whether a topic may still bring messages from before the stop.

        Reliable ones come in order: while one is sent again, those after it wait. So a topic that
        was published shortly before the stop is complete once it brings what is later than that.
        What is latched, or was published a few times only, may not be published again.
        """
        if time.time_ns() > self.stop_time + REPAIR * 1e9:
            return False
        return any(
            self.stop_time - REPAIR * 1e9 < heard <= self.stop_time
            and self.recorded[name].qos_profile.reliability == ReliabilityPolicy.RELIABLE
            and self.recorded[name].qos_profile.durability == DurabilityPolicy.VOLATILE
            and self.bag.count(name) > A_FEW
            and self.count_publishers(name)
            for name, heard in self.heard.items()
        )

    def stop(self, *_: object) -> None:
        """Finish when all that had been sent by the first call is recorded."""
        self.stop_time = self.stop_time or time.time_ns()


def request_for(offers: Sequence[QoSProfile]) -> QoSProfile:
    """The strictest request that all offers serve; without any: a reliable one."""
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=QUEUE_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if latched and offers else DurabilityPolicy.VOLATILE
        ),
    )


def is_compatible(offer: QoSProfile, request: QoSProfile) -> bool:
    """Whether messages pass between two profiles."""
    return bool(qos_check_compatible(offer, request)[0] != QoSCompatibility.ERROR)


def to_metadata(qos: QoSProfile) -> Qos:
    """Return a profile as metadata.yaml holds it."""

    def to_parts(duration: Duration) -> dict[str, int]:
        return dict(zip(("sec", "nsec"), divmod(duration.nanoseconds, 10**9), strict=True))

    return {
        "history": qos.history.name.lower(),
        "depth": qos.depth,
        "reliability": qos.reliability.name.lower(),
        "durability": qos.durability.name.lower(),
        "deadline": to_parts(qos.deadline),
        "lifespan": to_parts(qos.lifespan),
        "liveliness": qos.liveliness.name.lower(),
        "liveliness_lease_duration": to_parts(qos.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": qos.avoid_ros_namespace_conventions,
    }


def find_message_class(type_name: str) -> type[Any] | None:
    """Import a message type; None if it is not installed or a bag could not describe it."""
    package, kind, name = type_name.split("/")
    try:
        message_class = getattr(import_module(f"{package}.{kind}"), name)
    except (ImportError, AttributeError):
        return None
    return message_class if is_known(type_name) else None


def parse(arguments: Sequence[str]) -> Namespace:
    """Return the options of the command line."""
    parser = ArgumentParser("record_bag", description="Record topics into a rosbag2 directory.")
    default = Path(datetime.now().strftime("climber_bag_%Y_%m_%d-%H_%M_%S"))
    parser.add_argument("--output", "-o", type=Path, default=default, help="a new directory")
    parser.add_argument("--storage", "-s", choices=STORAGES, default="mcap")
    for option, meaning in {"--topics": "default: all", "--exclude": "not these"}.items():
        parser.add_argument(option, nargs="+", type=topic_name, default=[], help=meaning)
    return parser.parse_args(arguments)


def topic_name(name: str) -> str:
    """Return a name that may be one of a topic."""
    try:
        validate_topic_name(name)
    except InvalidTopicNameException:
        raise ArgumentTypeError(f"{name!r} is no name of a topic") from None
    return name


def record(options: Namespace) -> None:
    """Record until a signal comes."""
    recorder = BagRecorder(options)
    # Our own handlers: those of rclpy would cut off what has arrived and is not yet recorded, and
    # KeyboardInterrupt, a second one too, might come in the middle of a write.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, recorder.stop)
    try:
        recorder.run()
    finally:
        recorder.bag.close()
        recorder.get_logger().info(f"{recorder.bag.message_count} messages in {recorder.bag.path}")
        recorder.destroy_node()


def main() -> None:
    """Run the recorder."""
    options = parse(remove_ros_args(sys.argv)[1:])
    use_udp()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        record(options)
    except KeyboardInterrupt:
        pass
    except OSError as error:
        sys.exit(f"record_bag: {error}")
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
