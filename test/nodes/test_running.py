"""What all nodes have in common, in the process of the test."""

from types import SimpleNamespace

import pytest
import rclpy
from world import new_domain

from climber_uk.mechanics import SECOND
from climber_uk.ros import running

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
    time = SimpleNamespace(nanoseconds=0)
    monkeypatch.setattr(running, "WALL_CLOCK", SimpleNamespace(now=lambda: time))
    for number in range(20):
        node.report("wheels", "" if number % 2 else "stuck")
    node.report("wheels", "gone", "both")
    node.report("seal", "worn")
    node.check_publishers()

    def said():
        return [line.split("]: ")[1] for line in capfd.readouterr().err.splitlines()]

    assert said() == [*["wheels: stuck", "wheels: ok again"] * 3, "seal: worn"]
    time.nanoseconds = round(running.LINES_PERIOD * SECOND)
    node.check_publishers()
    node.check_publishers()
    assert said() == ["wheels: gone (both) [14 changes were not logged]"]
