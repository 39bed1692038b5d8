import os
import random
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rclpy
import yaml
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, Transform, Twist, Vector3
from nav_msgs.msg import Goals, Odometry
from nav_msgs.msg import Path as PathMessage
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, Header, Int64, String
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint
from world import new_domain

from climber_uk.analysis.bag import read_messages
from climber_uk.nodes.record_bag import is_compatible, request_for

# the wheels' generator of message types, which rclpy imports, uses deprecated modules
pytestmark = pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning")

ROOT = Path(__file__).parents[2]
STORAGES = ["mcap", "sqlite3"]
TIMEOUT = 30.0  # [s] discovery has a long tail
# a shell without a terminal lets what it puts into the background ignore SIGINT
IN_BACKGROUND = ["sh", "-c", 'trap "" INT; exec "$@"', "sh"]
RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
LATCHED, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE


def wait_until(condition, what):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within {TIMEOUT} s"
        time.sleep(0.005)


class Recorder:
    """A recorder in a process of its own."""

    def __init__(self, directory, domain, options, through=()):
        self.bag = directory / "bag"
        self._log = directory / "log"
        command = [sys.executable, "-m", "climber_uk.nodes.record_bag", "--output", str(self.bag)]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [*through, *command, *options], cwd=ROOT, env=environment, stderr=log
            )

    @property
    def log(self):
        return self._log.read_text()

    def end(self, *signals):
        for number in signals:
            self.process.send_signal(number)
        assert self.process.wait(TIMEOUT) == 0, self.log
        assert "Traceback" not in self.log

    def numbers(self, topic="/numbers"):
        return [message.data for _, _, message in read_messages(self.bag, [topic])]

    def topics(self):
        """The topics in metadata.yaml, which is there, and whole, while the recorder runs."""
        text = (self.bag / "metadata.yaml").read_text()
        topics = yaml.safe_load(text)["rosbag2_bagfile_information"]["topics_with_message_count"]
        return {topic["topic_metadata"]["name"]: topic for topic in topics}

    def wait_for(self, counts):
        """Wait until so many messages of each topic are recorded."""

        def is_recorded():
            recorded = {name: topic["message_count"] for name, topic in self.topics().items()}
            return recorded.items() >= counts.items()

        wait_until(is_recorded, f"recording of {counts}")


class Graph:
    """A domain of the test's own with a node of the test and the recorder it starts."""

    def __init__(self, directory):
        self.directory = directory
        self.domain = new_domain()
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain)
        self.node = Node("test", context=self.context, enable_rosout=False)
        self.recorder = None

    def close(self):
        if self.recorder:
            self.recorder.process.kill()
            self.recorder.process.wait()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def publisher(self, topic, message_class, reliability=RELIABLE, durability=VOLATILE):
        # deep enough for all that a busy machine delays
        qos = QoSProfile(depth=1000, reliability=reliability, durability=durability)
        return self.node.create_publisher(message_class, topic, qos)

    def finish(self, *publishers):
        """Publish no more, so that the recorder need not wait for more."""
        deliver(*publishers)
        for publisher in publishers:
            self.node.destroy_publisher(publisher)

    def record(self, *options, through=()):
        self.recorder = Recorder(self.directory, self.domain, options, through)
        return self.recorder


def wait_for_subscription(*publishers):
    wait_until(lambda: all(p.get_subscription_count() for p in publishers), "subscription")


@pytest.fixture
def graph(tmp_path):
    graph = Graph(tmp_path)
    yield graph
    graph.close()


def deliver(*publishers):
    """Wait until the recorder's process has what was published, recorded or not."""
    assert all(p.wait_for_all_acked(Duration(seconds=TIMEOUT)) for p in publishers)


def publish_numbers(publisher, rate, seconds):
    """Publish 0, 1, 2, … at a rate [Hz] and return how many."""
    start, count = time.monotonic(), int(rate * seconds)
    for number in range(count):
        publisher.publish(Int64(data=number))
        time.sleep(max(0.0, start + (number + 1) / rate - time.monotonic()))
    return count


def some_messages(seed):
    """A message of each type, with arbitrary bits in its numbers."""
    draw = random.Random(seed)

    def number():
        return struct.unpack("d", draw.randbytes(8))[0]

    stamp = Time(sec=draw.randrange(2**31), nanosec=draw.randrange(10**9))
    header = Header(stamp=stamp, frame_id="odom")
    odometry = Odometry(header=header, child_frame_id="base_link")
    odometry.pose.pose.position.x = number()
    odometry.pose.covariance = [number() for _ in range(36)]
    trajectory = MultiDOFJointTrajectory(header=header, joint_names=["base_link"])
    for _ in range(draw.randrange(5)):
        transform = Transform(translation=Vector3(x=number(), y=number(), z=number()))
        twist = Twist(linear=Vector3(x=number(), y=number(), z=number()))
        trajectory.points.append(
            MultiDOFJointTrajectoryPoint(
                transforms=[transform], velocities=[twist], accelerations=[twist]
            )
        )
    effort = [number() for _ in range(draw.randrange(4))]
    return {
        "/odom": odometry,
        "/wheel_torques": JointState(header=header, name=["left", "right"], effort=effort),
        "/reference": trajectory,
        "/climber/commands": Float64MultiArray(data=effort),
        "/words": String(data="Wand " * draw.randrange(9) + "ä"),
    }


def bits(value):
    """The fields of a message; serialised ones differ in what happens to lie between them."""
    match value:
        case float():
            return struct.pack("d", value)
        case int() | str() | bytes():
            return value
        case _ if hasattr(value, "get_fields_and_field_types"):
            return {name: bits(getattr(value, name)) for name in value.get_fields_and_field_types()}
    return [bits(element) for element in value]


@pytest.mark.nodes
@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_holds_bit_for_bit_what_was_published(graph, storage):
    path = PathMessage(poses=[PoseStamped(header=Header(frame_id="odom"))] * 3)
    latched = graph.publisher("/reference_path", PathMessage, durability=LATCHED)
    latched.publish(path)
    publishers = {name: graph.publisher(name, type(m)) for name, m in some_messages(0).items()}
    recorder = graph.record("--storage", storage)
    wait_for_subscription(latched, *publishers.values())

    published = {name: [] for name in publishers} | {"/reference_path": [path]}
    for seed in range(50):
        for name, message in some_messages(seed).items():
            publishers[name].publish(message)
            published[name].append(message)
    recorder.wait_for({name: len(messages) for name, messages in published.items()})
    graph.finish(*publishers.values())
    recorder.end(signal.SIGINT)

    recorded = {name: [] for name in published}
    with AnyReader([recorder.bag]) as reader:
        for connection, _, data in reader.messages():
            if connection.topic in published:
                message_class = type(published[connection.topic][0])
                recorded[connection.topic].append(deserialize_message(data, message_class))
        assert f"{reader.message_count} messages in {recorder.bag}" in recorder.log
    assert recorder.log.count("recording /odom [nav_msgs/msg/Odometry]") == 1
    for name, messages in published.items():
        assert [bits(m) for m in recorded[name]] == [bits(m) for m in messages]


@pytest.mark.nodes
@pytest.mark.parametrize("storage", STORAGES)
def test_nothing_is_lost_at_1_khz(graph, storage):
    publisher = graph.publisher("numbers", Int64)
    recorder = graph.record("--storage", storage, through=IN_BACKGROUND)
    wait_for_subscription(publisher)

    count = publish_numbers(publisher, rate=1000, seconds=3)
    graph.finish(publisher)
    recorder.end(signal.SIGTERM)

    assert recorder.numbers() == list(range(count))


@pytest.mark.nodes
@pytest.mark.parametrize("storage", STORAGES)
def test_a_killed_recorder_loses_at_most_the_last_second(graph, storage):
    publisher = graph.publisher("numbers", Int64)
    recorder = graph.record("--storage", storage)
    wait_for_subscription(publisher)
    publisher.publish(Int64(data=-1))
    deliver(publisher)  # from now on without delay

    publish_numbers(publisher, rate=1000, seconds=1.6)
    recorder.process.kill()
    killed = time.time_ns()
    recorder.process.wait()

    read = [(log_time, m.data) for _, log_time, m in read_messages(recorder.bag, ["/numbers"])]
    assert [number for _, number in read] == list(range(-1, len(read) - 1))
    assert killed - read[-1][0] < 1e9


@pytest.mark.nodes
def test_what_was_lost_before_the_stop_and_is_sent_again_is_recorded(graph):
    rare, frequent = graph.publisher("rare", Int64), graph.publisher("frequent", Int64)
    recorder = graph.record()
    wait_for_subscription(rare, frequent)
    for number in range(10):
        rare.publish(Int64(data=number))
    recorder.wait_for({"/rare": 10})

    recorder.process.send_signal(signal.SIGSTOP)
    for number in range(5000):  # more than a process that does not read has room for
        frequent.publish(Int64(data=number))
    for number in range(10, 20):
        rare.publish(Int64(data=number))
    recorder.end(signal.SIGTERM, signal.SIGCONT)

    assert recorder.numbers("/rare") == list(range(20))


@pytest.mark.nodes
@pytest.mark.parametrize("further", [1, 10_000])
def test_further_interrupts_leave_the_bag_complete(graph, further):
    publisher = graph.publisher("numbers", Int64)
    recorder = graph.record()
    wait_for_subscription(publisher)

    count = publish_numbers(publisher, rate=1000, seconds=0.2)
    recorder.wait_for({"/numbers": count})
    recorder.process.send_signal(signal.SIGINT)
    for _ in range(further):
        recorder.process.send_signal(signal.SIGINT)
        if recorder.process.poll() is not None:
            break
        time.sleep(0.005)
    recorder.end()

    assert recorder.numbers() == list(range(count))
    with AnyReader([recorder.bag]) as reader:
        assert reader.topics["/numbers"].msgcount == count
        assert reader.message_count == len(list(reader.messages()))


@pytest.mark.nodes
def test_the_topics_asked_for_are_recorded_at_the_time_of_the_system_clock(graph):
    publishers = [graph.publisher(name, Int64) for name in ("/numbers", "/ns/numbers", "/others")]
    goals = graph.publisher("goals", Goals)
    options = ["--topics", "numbers", "/ns/numbers", "/others", "goals", "--exclude", "others"]
    recorder = graph.record(*options, "--ros-args", "-p", "use_sim_time:=true")
    wait_for_subscription(*publishers[:2])

    before = time.time_ns()
    for publisher in publishers:
        publisher.publish(Int64(data=7))
    recorder.wait_for({"/numbers": 1, "/ns/numbers": 1})
    after = time.time_ns()
    recorder.end(signal.SIGTERM)

    read = list(read_messages(recorder.bag))
    assert sorted(topic for topic, _, _ in read) == ["/ns/numbers", "/numbers"]
    assert all(before < log_time < after for _, log_time, _ in read)
    assert goals.get_subscription_count() == 0
    assert recorder.log.count("not recording /goals: unknown type nav_msgs/msg/Goals") == 1


@pytest.mark.nodes
def test_publishers_may_come_later_and_offer_less_or_more(graph):
    topics = ["numbers", "plain", "sensor", "latched"]
    for topic in topics:
        graph.node.create_subscription(Int64, topic, print, 10)
    recorder = graph.record()
    ends = graph.node.get_subscriptions_info_by_topic
    wait_until(lambda: all(len(ends(f"/{t}")) == 2 for t in topics), "subscription")

    plain = graph.publisher("plain", Int64)
    latched = graph.publisher("latched", Int64, durability=LATCHED)
    latched.publish(Int64(data=1))  # perhaps before anybody listens
    sensor = graph.publisher("sensor", Int64, BEST_EFFORT)
    both = [graph.publisher("numbers", Int64), graph.publisher("numbers", Int64, BEST_EFFORT)]
    # none of the test's own, reliable subscriptions matches a best-effort publisher
    matches = {plain: 2, latched: 2, sensor: 1, both[0]: 2, both[1]: 1}
    wait_until(
        lambda: all(p.get_subscription_count() == n for p, n in matches.items()), "subscription"
    )
    for publisher in (plain, sensor, *both):
        publisher.publish(Int64(data=2))
    recorder.wait_for({"/numbers": 2, "/plain": 1, "/sensor": 1, "/latched": 1})
    recorder.end(signal.SIGTERM)

    assert [recorder.numbers(f"/{t}") for t in topics] == [[2, 2], [2], [2], [1]]
    offered = {
        name: topic["topic_metadata"]["offered_qos_profiles"]
        for name, topic in recorder.topics().items()
    }
    assert [qos["reliability"] for qos in offered["/sensor"]] == ["best_effort"]
    assert [qos["durability"] for qos in offered["/latched"]] == ["transient_local"]


def run_record_bag(*options):
    command = [sys.executable, "-m", "climber_uk.nodes.record_bag", *options]
    return subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "ROS_DOMAIN_ID": str(new_domain())},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )


@pytest.mark.nodes
def test_an_existing_directory_is_refused_in_one_line(tmp_path):
    result = run_record_bag("--output", str(tmp_path))

    assert result.returncode != 0
    assert result.stderr == f"record_bag: output directory {tmp_path} exists already\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nodes
def test_an_unknown_storage_is_refused_with_the_known_ones(tmp_path):
    result = run_record_bag("--output", str(tmp_path / "bag"), "--storage", "csv")

    assert result.returncode != 0
    assert "invalid choice: 'csv' (choose from 'mcap', 'sqlite3')" in result.stderr
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "bag").exists()


@pytest.mark.nodes
def test_a_bad_topic_name_is_refused_without_a_trace(tmp_path):
    result = run_record_bag("--output", str(tmp_path / "bag"), "--topics", "od om")

    assert result.returncode != 0
    assert "--topics: 'od om' is no name of a topic" in result.stderr
    assert "Traceback" not in result.stderr
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize(
    ("offers", "reliability", "durability"),
    [
        ([], RELIABLE, VOLATILE),
        ([(RELIABLE, VOLATILE)], RELIABLE, VOLATILE),
        ([(BEST_EFFORT, VOLATILE)], BEST_EFFORT, VOLATILE),
        ([(RELIABLE, LATCHED)], RELIABLE, LATCHED),
        ([(RELIABLE, LATCHED), (RELIABLE, VOLATILE)], RELIABLE, VOLATILE),
        ([(RELIABLE, LATCHED), (BEST_EFFORT, LATCHED)], BEST_EFFORT, LATCHED),
    ],
)
def test_the_request_is_the_strictest_that_all_publishers_serve(offers, reliability, durability):
    profiles = [QoSProfile(depth=1, reliability=r, durability=d) for r, d in offers]

    request = request_for(profiles)

    assert (request.reliability, request.durability) == (reliability, durability)
    assert all(is_compatible(offer, request) for offer in profiles)
