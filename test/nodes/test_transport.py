"""Nodes talk by UDP unless told otherwise, and all others of the domain hear them all the same."""

import os
import sys
from pathlib import Path

import pytest

from climber_uk.ros.transport import (
    LOCALHOST,
    ONLY_LOCAL,
    PROFILES,
    RANGE,
    TRANSPORTS,
    free_domain,
    use_udp,
)

UDP, LOCAL = {TRANSPORTS: "UDPv4"}, {RANGE: "SUBNET", PROFILES: str(LOCALHOST)}
SHARED_MEMORY = "/dev/shm/fastrtps", "/dev/shm/fastdds"  # up to Jazzy, and from Kilted on


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ({}, UDP),
        ({RANGE: "SUBNET"}, UDP | {RANGE: "SUBNET"}),
        ({RANGE: "OFF"}, UDP | {RANGE: "OFF"}),
        ({RANGE: "LOCALHOST"}, UDP | LOCAL),
        ({ONLY_LOCAL: "1"}, UDP | LOCAL),
        ({ONLY_LOCAL: "0"}, UDP),
        ({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp", RANGE: "LOCALHOST"}, UDP | LOCAL),
        # whoever has chosen is left alone
        ({TRANSPORTS: "DEFAULT", RANGE: "LOCALHOST"}, None),
        ({PROFILES: "mine.xml", RANGE: "LOCALHOST"}, None),
        ({"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp", RANGE: "LOCALHOST"}, None),
    ],
)
def test_udp_is_chosen_where_nothing_else_was_and_the_range_stays(before, after):
    environment = dict(before)
    use_udp(environment)
    assert environment == before if after is None else environment.items() >= after.items()
    again = dict(environment)
    use_udp(again)
    assert again == environment


def test_the_tests_themselves_have_the_transport_that_is_the_default():
    assert os.environ.items() >= (UDP | LOCAL).items()


def test_a_demonstration_takes_a_domain_that_nobody_is_in(world, monkeypatch):
    """Two in the same one would drive each other's climber."""
    monkeypatch.setattr(os, "getpid", lambda: world.domain - 1)  # which is where it looks first
    domain, mark = free_domain()
    another, other_mark = free_domain()  # before anybody has gone into the first one
    assert len({world.domain, domain, another}) == 3
    mark.close()
    other_mark.close()


ONCE = """
import rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node, heard = rclpy.create_node("once"), []
node.create_subscription(JointState, "joint_states", heard.append, 10)
while not heard:
    rclpy.spin_once(node)
"""


def chooses(world, **chosen):
    """Make these all that is chosen of the middleware, for the processes started from now on."""
    for name in (TRANSPORTS, PROFILES, RANGE):
        world.environment.pop(name, None)
    world.environment.update(chosen)


def uses_shared_memory(process):
    maps = Path(f"/proc/{process.pid}/maps").read_text()
    return any(name in maps for name in SHARED_MEMORY)


@pytest.mark.nodes
@pytest.mark.parametrize(
    ("published_in", "heard_in"),
    [
        ("SUBNET", "LOCALHOST"),
        ("LOCALHOST", "SUBNET"),
        pytest.param("SUBNET", "SUBNET", marks=pytest.mark.soak),
        pytest.param("LOCALHOST", "LOCALHOST", marks=pytest.mark.soak),
    ],
)
def test_those_who_have_shared_memory_hear_a_node_that_has_not(world, published_in, heard_in):
    chooses(world, **{RANGE: published_in})
    plant = world.start_node("plant_simulator")
    chooses(world, **{RANGE: heard_in})
    once = world.run("once", sys.executable, "-c", ONCE)
    world.wait(lambda: once.poll() == 0, "message at a process of somebody else")
    assert not uses_shared_memory(plant)


@pytest.mark.nodes
@pytest.mark.installed  # and so is the profile
def test_every_node_leaves_shared_memory_alone_unless_told_to_use_it(world, tmp_path):
    chooses(world, **{RANGE: "LOCALHOST"})
    nodes = {
        "trajectory_publisher": [],
        "uk_torque_controller": [],
        "plant_simulator": [],
        "markers": [],
        "record_bag": ["--output", tmp_path / "bag"],
    }
    processes = [world.start(name, *words) for name, words in nodes.items()]
    world.wait(lambda: set(nodes) <= set(world.node.get_node_names()), "nodes")
    assert not any(map(uses_shared_memory, processes))
    world.end("markers")
    chooses(world, **{RANGE: "LOCALHOST", TRANSPORTS: "DEFAULT"})
    told = world.start("markers")
    world.wait(lambda: uses_shared_memory(told), "shared memory")
