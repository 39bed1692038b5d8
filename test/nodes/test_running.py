"""What all nodes have in common, in the process of the test."""

import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from world import TIMEOUT, new_domain

from climber_uk.mechanics import SECOND
from climber_uk.parameters.parameter_files import ParameterFiles
from climber_uk.ros import running

ODOMETRY = "nav_msgs/msg/Odometry"
SUFFIX = {SetParameters: "", SetParametersAtomically: "_atomically"}

pytestmark = pytest.mark.nodes


@pytest.fixture
def node():
    rclpy.init(domain_id=new_domain())
    node = running.ClimberNode("climber", arguments=[])
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_of_troubles_that_come_and_go_some_are_said_and_the_last_one_in_the_end(
    node, monkeypatch, capfd
):
    now = SimpleNamespace(nanoseconds=0)
    monkeypatch.setattr(running, "WALL_CLOCK", SimpleNamespace(now=lambda: now))
    for number in range(20):
        node.report("wheels", "" if number % 2 else "stuck")
    node.report("wheels", "gone", "both")
    node.report("seal", "worn")
    node.check_publishers()

    def said():
        return [line.split("]: ")[1] for line in capfd.readouterr().err.splitlines()]

    assert said() == [*["wheels: stuck", "wheels: ok again"] * 3, "seal: worn"]
    now.nanoseconds = round(running.LINES_PERIOD * SECOND)
    node.check_publishers()
    node.check_publishers()
    assert said() == ["wheels: gone (both) [14 changes were not logged]"]


def test_a_topic_on_which_another_type_is_published_is_said(node, capfd):
    node.subscription(Odometry, "odom", lambda _: None)
    node.publisher(Odometry, "odom")
    node.check_types()
    elsewhere = Context()  # one participant has one type on a topic
    rclpy.init(context=elsewhere, domain_id=node.context.get_domain_id())
    try:
        other = rclpy.create_node("other", context=elsewhere)
        publisher = other.create_publisher(PoseStamped, "odom", 1)
        said = wait_for_line(node.check_types, capfd)
        assert said == "type of /odom: geometry_msgs/msg/PoseStamped is published, not " + ODOMETRY
        other.destroy_publisher(publisher)
        assert wait_for_line(node.check_types, capfd) == "type of /odom: ok again"
        other.destroy_node()
    finally:
        rclpy.shutdown(context=elsewhere)


def wait_for_line(do, capfd):
    """Do it until a line is logged: the middleware takes its time."""
    end = time.monotonic() + TIMEOUT
    while not (said := capfd.readouterr().err):
        assert time.monotonic() < end
        time.sleep(0.05)
        do()
    (line,) = said.splitlines()
    return line.split("]: ")[1]


@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically])
def test_a_request_for_parameters_that_is_none_does_not_end_the_node(node, capfd, kind):
    value = ParameterValue(type=77)  # of which there is none
    request = kind.Request(parameters=[Parameter(name="left_wheel_joint", value=value)] * 2)
    client = node.create_client(kind, f"climber/set_parameters{SUFFIX[kind]}")
    assert client.wait_for_service(TIMEOUT)
    answer = client.call_async(request)
    rclpy.spin_until_future_complete(node, answer, timeout_sec=TIMEOUT)
    results = getattr(answer.result(), "results", None) or [answer.result().result]
    assert {result.reason for result in results} == {"77 is not a valid Parameter.Type"}
    assert "request for parameters: refused (77 is not" in capfd.readouterr().err


def test_what_others_told_has_an_end_and_is_safe_to_print(node, capfd):
    node.report("names", "refused", "a\x1b[2J" + "x" * 10**6)
    (line,) = capfd.readouterr().err.splitlines()
    assert r"a\x1b[2Jxxx" in line
    assert len(line) < 2 * running.LONGEST_LINE


ENDLESS = """
import time
from climber_uk.ros import running
running.LONGEST_START = 1
def make_nodes():
    print("begins", flush=True)
    while True:  # a signal just before one long sleep would be looked at after it
        time.sleep(0.01)
running.run(make_nodes, None)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_start_without_end_is_ended_by_a_signal_or_two(number):
    command = [sys.executable, "-c", ENDLESS]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        assert process.stdout.readline() == b"begins\n"
        process.send_signal(number)
        process.send_signal(number)
        assert process.communicate(timeout=TIMEOUT)[0] == b""
        assert process.returncode == -signal.SIGALRM


@pytest.mark.parametrize("name", ["pipe", "/dev/zero"])
def test_a_parameter_file_that_can_be_read_only_once_is_refused(tmp_path, name):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ValueError, match=r"(pipe|zero) is no regular file"):
        ParameterFiles(["--ros-args", "--params-file", str(tmp_path / name)], "/x")


def test_an_option_without_its_parameter_file_is_refused():
    with pytest.raises(ValueError, match="--params-file wants a file"):
        ParameterFiles(["--ros-args", "--params-file"], "/x")
