"""Transforms on /tf, where tf2_msgs is installed: by tf2's own definition, and none if unwanted."""

import pytest
from generated_interface import importable
from nav_msgs.msg import Odometry
from test_wall_odometry import Told

# each starts a node that imports anew, and the definition is compiled
pytestmark = [pytest.mark.nodes, pytest.mark.soak]


@pytest.fixture(scope="module", autouse=True)
def transforms(tmp_path_factory):
    """Type of /tf."""
    with importable("tf2_msgs", tmp_path_factory.mktemp("tf2_msgs")):
        from tf2_msgs.msg import TFMessage

        yield TFMessage


def frames_of(message):
    (transform,) = message.transforms
    return transform.header.frame_id, transform.child_frame_id


def test_wall_odometry_tells_where_odom_is_in_the_map(world, transforms):
    world.start_node("wall_odometry", "initial_heading:=1.0", "initial_heading_deviation:=0.01")
    heard = world.listen(transforms, "/tf")
    told = Told(world)
    world.wait(lambda: told.go_on() and heard, "transform")
    assert frames_of(heard[-1]) == ("map", "odom")


def test_the_plant_tells_where_the_climber_is(world, transforms):
    world.start_node("plant_simulator")
    heard = world.listen(transforms, "/tf")
    world.wait(lambda: heard, "transform")
    assert frames_of(heard[-1]) == ("odom", "base_link")


@pytest.mark.parametrize("node", ["wall_odometry", "plant_simulator"])
def test_nobody_publishes_transforms_that_are_switched_off(world, node):
    world.start_node(node, "publish_tf:=false")
    world.listen(Odometry, "odom")
    world.wait(lambda: world.node.count_publishers("/diagnostics"), "what it makes last")
    assert not world.node.count_publishers("/tf")
