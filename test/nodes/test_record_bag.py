import os
import random
import shutil
import signal
import sqlite3
import struct
import subprocess
import time
from contextlib import closing
from importlib.metadata import version

import pytest
import rclpy
import yaml
from bag_contents import read_messages
from builtin_interfaces.msg import Time
from forking import Forked
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
from world import TIMEOUT, executable, new_domain

from climber_uk.recording.offered_qos import is_compatible, request_for

# the wheels' generator of message types, which rclpy imports, uses deprecated modules
pytestmark = pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning")

STORAGES = ["mcap", "sqlite3"]
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
        directory.mkdir(exist_ok=True)
        self.bag = directory / "bag"
        self._log = directory / "log"
        words = ["--output", str(self.bag), *options]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        self._log.write_text("")
        if through:
            command = [*through, executable("record_bag"), *words]
            with self._log.open("a") as log:
                self.process = subprocess.Popen(command, env=environment, stderr=log)
        else:
            self.process = Forked("record_bag", words, self._log, environment)

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
            if not (self.bag / "metadata.yaml").exists():
                return False
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
        self.others = []

    def another_node(self):
        """A node of another participant: in one of them, a topic has one type."""
        context = Context()
        rclpy.init(context=context, domain_id=self.domain)
        self.others.append(Node("other", context=context, enable_rosout=False))
        return self.others[-1]

    def close(self):
        if self.recorder:
            print(f"recorder: {self.recorder.process.poll()}\n{self.recorder.log}")  # if it fails
            self.recorder.process.kill()
            self.recorder.process.wait()
        for node in (self.node, *self.others):
            node.destroy_node()
            rclpy.shutdown(context=node.context)

    def publisher(
        self, topic, message_class, reliability=RELIABLE, durability=VOLATILE, depth=1000
    ):
        qos = QoSProfile(depth=depth, reliability=reliability, durability=durability)
        return self.node.create_publisher(message_class, topic, qos)

    def finish(self, *publishers):
        """Publish no more, so that the recorder need not wait for more."""
        deliver(*publishers)
        for publisher in publishers:
            self.node.destroy_publisher(publisher)

    def record(self, *options, through=(), name=""):
        self.recorder = Recorder(self.directory / name, self.domain, options, through)
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
    publisher = graph.publisher("numbers", Int64, depth=3000)  # all of them
    recorder = graph.record("--storage", storage, through=IN_BACKGROUND)
    wait_for_subscription(publisher)

    count = publish_numbers(publisher, rate=1000, seconds=3)
    graph.finish(publisher)
    recorder.end(signal.SIGTERM)

    assert recorder.numbers() == list(range(count))


@pytest.mark.nodes
@pytest.mark.parametrize("storage", STORAGES)
def test_a_killed_recorder_loses_at_most_the_last_second(graph, storage):
    def lost(name):
        """Time [s] of messages that a recorder loses."""
        publisher = graph.publisher(name, Int64)
        recorder = graph.record("--storage", storage, name=name)
        wait_for_subscription(publisher)
        publisher.publish(Int64(data=-1))
        deliver(publisher)  # from now on without delay

        publish_numbers(publisher, rate=1000, seconds=1.6)
        recorder.process.kill()
        killed = time.time_ns()
        recorder.process.wait()

        read = [(log_time, m.data) for _, log_time, m in read_messages(recorder.bag, [f"/{name}"])]
        assert [number for _, number in read] == list(range(-1, len(read) - 1))
        return (killed - read[-1][0]) / 1e9

    # a busy machine may hold up one, but not each of them
    assert any(lost(name) < 1.0 for name in ("first", "second", "third"))


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


@pytest.mark.nodes
def test_once_a_node_s_latched_message_is_recorded_all_that_it_publishes_is(graph):
    """By the order of subscriptions: in that of the alphabet it would be the first."""
    recorder = graph.record()
    recorder.wait_for({})
    publishers = [graph.publisher(f"topic_{number}", Int64) for number in range(40)]
    graph.publisher("latched", Int64, durability=LATCHED).publish(Int64(data=1))
    recorder.wait_for({"/latched": 1})
    for publisher in publishers:
        publisher.publish(Int64(data=2))
    graph.finish(*publishers)
    recorder.end(signal.SIGTERM)

    assert [recorder.numbers(f"/topic_{number}") for number in range(40)] == [[2]] * 40


@pytest.mark.nodes
@pytest.mark.parametrize("storage", STORAGES)
def test_of_a_second_type_on_a_topic_nothing_comes_into_the_bag_and_it_is_said_once(graph, storage):
    """One is there before that which is recorded, but nobody publishes it; one comes later.

    Each by a participant of its own, and both before it in the alphabet.
    """
    before, after = graph.another_node(), graph.another_node()
    before.create_subscription(Float64MultiArray, "numbers", print, 10)
    recorder = graph.record("--storage", storage)
    wait_until(lambda: "recording /numbers [std_msgs/msg/Float64MultiArray]" in recorder.log, "it")
    numbers = graph.publisher("numbers", Int64)
    wait_until(lambda: numbers.get_subscription_count(), "subscription")
    numbers.publish(Int64(data=1))
    recorder.wait_for({"/numbers": 1})
    others = after.create_publisher(Header, "numbers", 10)
    said = "not recording {} on /numbers, which is recorded as std_msgs/msg/Int64"
    types = "std_msgs/msg/Float64MultiArray", "std_msgs/msg/Header"
    wait_until(lambda: all(said.format(t) in recorder.log for t in types), "a word")
    for number in (2, 3):
        others.publish(Header(frame_id="x" * 100))
        numbers.publish(Int64(data=number))
    recorder.wait_for({"/numbers": 3})
    graph.finish(numbers)
    recorder.end(signal.SIGTERM)

    assert recorder.numbers() == [1, 2, 3]
    assert recorder.topics()["/numbers"]["topic_metadata"]["type"] == "std_msgs/msg/Int64"
    assert [recorder.log.count(said.format(t)) for t in types] == [1, 1]


@pytest.mark.nodes
def test_what_the_middleware_lost_is_told_and_counted_in_the_metadata(graph):
    """A best-effort publisher goes on while the recorder does not read."""
    publisher = graph.publisher("numbers", Int64, BEST_EFFORT)
    whole = graph.publisher("whole", Int64)
    recorder = graph.record()
    wait_for_subscription(publisher, whole)
    numbers = iter(range(1_000_000))

    def publish_until(condition):
        def step():
            publisher.publish(Int64(data=next(numbers)))
            return condition()

        wait_until(step, "message")

    publish_until(lambda: recorder.topics().get("/numbers", {}).get("message_count", 0) >= 10)
    whole.publish(Int64(data=1))
    recorder.process.send_signal(signal.SIGSTOP)
    for _ in range(20_000):
        publisher.publish(Int64(data=next(numbers)))
    recorder.process.send_signal(signal.SIGCONT)
    publish_until(lambda: "messages on /numbers are lost" in recorder.log)
    graph.finish(whole)
    recorder.end(signal.SIGTERM)

    text = (recorder.bag / "metadata.yaml").read_text()
    told = yaml.safe_load(text)["rosbag2_bagfile_information"]["custom_data"]
    # a busy machine may have filled its queue as well
    assert (
        {"messages lost on /numbers"}
        <= set(told)
        <= {
            "messages lost on /numbers",
            "queue full on /numbers",
        }
    )
    read = recorder.numbers()
    missing = read[-1] - read[0] + 1 - len(read)
    assert missing > 1000
    assert int(told["messages lost on /numbers"]) >= missing
    assert f"messages lost on /numbers: {told['messages lost on /numbers']}" in recorder.log


SET_CLOCK = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *now)
{
    static int (*real)(clockid_t, struct timespec *);
    struct stat file;
    if (!real)
        real = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real(clock, now);
    const char *set_back = getenv("SET_BACK");
    if (clock == CLOCK_REALTIME && set_back && !stat(set_back, &file))
        now->tv_sec -= 100;
    return result;
}
"""


@pytest.mark.nodes
@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_log_times_go_on_though_the_system_clock_is_set_back(graph, tmp_path, monkeypatch):
    """By 100 s, for the recorder, once a file is there."""
    (tmp_path / "clock.c").write_text(SET_CLOCK)
    library, is_set = tmp_path / "clock.so", tmp_path / "set"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, tmp_path / "clock.c"], check=True)
    monkeypatch.setenv("SET_BACK", str(is_set))
    publisher = graph.publisher("numbers", Int64)
    recorder = graph.record(through=["env", f"LD_PRELOAD={library}"])
    wait_for_subscription(publisher)
    count, before = 90, time.time_ns()
    for number in range(count):
        if number == 30:
            recorder.wait_for({"/numbers": number})
            is_set.touch()
        if number == 60:
            wait_until(lambda: "clock was set back by 100.0" in recorder.log, "word of the step")
        publisher.publish(Int64(data=number))
    graph.finish(publisher)
    recorder.end(signal.SIGTERM)
    after = time.time_ns()

    read = [(log_time, m.data) for _, log_time, m in read_messages(recorder.bag, ["/numbers"])]
    times = [log_time for log_time, _ in read]
    assert [number for _, number in read] == list(range(count))
    assert before < times[0] < times[-1] < after
    assert len(set(times)) == count


@pytest.mark.nodes
def test_the_distribution_in_the_metadata_is_the_one_that_runs(graph, monkeypatch):
    major = version("rclpy").split(".")[0]
    installed = {"7": "jazzy", "9": "kilted"}[major]  # by which these tests run
    for name in (None, "kilted"):
        monkeypatch.delenv("ROS_DISTRO", raising=False)
        if name:
            monkeypatch.setenv("ROS_DISTRO", name)
        recorder = Recorder(graph.directory / str(name), graph.domain, ["--storage", "sqlite3"])
        recorder.wait_for({})
        recorder.end(signal.SIGTERM)
        text = (recorder.bag / "metadata.yaml").read_text()
        told = yaml.safe_load(text)["rosbag2_bagfile_information"]["ros_distro"]
        assert told == (name or installed)
        with closing(sqlite3.connect(recorder.bag / "bag_0.db3")) as database:
            assert database.execute("SELECT ros_distro FROM schema").fetchall() == [(told,)]


@pytest.mark.nodes
@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "output directory {bag} exists already"),
        (["--storage", "csv"], "invalid choice: 'csv' (choose from 'mcap', 'sqlite3')"),
        (["--topics", "od om"], "--topics: 'od om' is no name of a topic"),
    ],
)
def test_what_it_cannot_do_is_refused_in_words_and_leaves_nothing(tmp_path, options, said):
    exists = not options
    if exists:
        (tmp_path / "bag").mkdir()
    recorder = Recorder(tmp_path, new_domain(), options)

    assert recorder.process.wait(TIMEOUT) != 0
    *_, last = recorder.log.splitlines()
    assert said.format(bag=recorder.bag) in last
    assert "Traceback" not in recorder.log
    assert list(tmp_path.glob("bag/*")) == []
    assert recorder.bag.exists() == exists


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
