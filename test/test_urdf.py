"""The robot's description agrees with the nodes' parameters."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.climber import Climber

ROBOT = ElementTree.parse(Path(__file__).parents[1] / "urdf" / "climber.urdf").getroot()
JOINTS = {joint.get("name"): joint for joint in ROBOT.iter("joint")}
LINKS = {link.get("name"): link for link in ROBOT.iter("link")}
WHEELS = {1: "left_wheel_joint", -1: "right_wheel_joint"}  # by the side of y


def numbers(element, attribute):
    return np.array([float(number) for number in element.get(attribute).split()])


def link_and_origin(joint):
    """Child link of a joint, and where it is in base_link."""
    assert joint.find("parent").get("link") == "base_link"
    origin = joint.find("origin")
    link = LINKS[joint.find("child").get("link")]
    return link, np.zeros(3) if origin is None else numbers(origin, "xyz")


def bodies():
    """Mass, centre of mass in base_link and Izz of each link that has inertia."""
    for link, origin in map(link_and_origin, JOINTS.values()):
        inertial = link.find("inertial")
        offset = inertial.find("origin")
        centre = origin if offset is None else origin + numbers(offset, "xyz")
        inertia = inertial.find("inertia")
        yield float(inertial.find("mass").get("value")), centre, inertia


def test_joints_and_links_have_the_names_that_the_nodes_use():
    names = pytest.importorskip("climber_uk.ros.running").Names()
    assert [names.left_wheel_joint, names.right_wheel_joint] == list(WHEELS.values())
    assert set(WHEELS.values()) < set(JOINTS)
    assert names.base_frame in LINKS


def test_it_is_one_tree_whose_root_has_no_inertia():
    children = [joint.find("child").get("link") for joint in JOINTS.values()]
    assert sorted([*children, "base_link"]) == sorted(LINKS)
    assert LINKS["base_link"].find("inertial") is None  # robot_state_publisher would warn


@pytest.mark.parametrize("side", WHEELS)
def test_wheels_stand_on_the_wall_and_drive_forward_when_they_turn_forward(side):
    joint = JOINTS[WHEELS[side]]
    wheel, origin = link_and_origin(joint)
    radius = float(wheel.find("visual/geometry/cylinder").get("radius"))
    assert joint.get("type") == "continuous"
    assert radius == Climber().wheel_radius
    np.testing.assert_allclose(
        origin, [0, side * Climber().half_track, radius - Grip().centre_height]
    )
    # the lowest point of a wheel that drives forward goes backward
    lowest = np.cross(numbers(joint.find("axis"), "xyz"), [0, 0, -radius])
    np.testing.assert_allclose(lowest, [-radius, 0, 0])


def test_mass_and_inertia_are_those_of_the_parameters():
    masses, centres, inertias = zip(*bodies(), strict=True)
    assert sum(masses) == pytest.approx(Climber().mass)
    np.testing.assert_allclose(np.average(centres, axis=0, weights=masses), 0, atol=1e-4)
    yaw_inertia = sum(
        float(inertia.get("izz")) + mass * (centre[:2] @ centre[:2])
        for mass, centre, inertia in zip(masses, centres, inertias, strict=True)
    )
    assert yaw_inertia == pytest.approx(Climber().yaw_inertia, rel=1e-3)
    for inertia in inertias:  # of a real body: none exceeds the sum of the others
        moments = sorted(float(inertia.get(name)) for name in ("ixx", "iyy", "izz"))
        assert 0 < moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)


def test_cups_and_casters_are_where_the_contact_has_them():
    body, _ = link_and_origin(JOINTS["body_joint"])
    visuals = {visual.get("name"): visual for visual in body.iter("visual")}
    radii = [
        float(visuals[f"{side}_cup"].find("geometry/cylinder").get("radius"))
        for side in ("left", "right")
    ]
    assert sum(np.pi * np.square(radii)) == pytest.approx(Climber().suction_area, rel=1e-3)
    front, rear = (
        numbers(visuals[f"{end}_caster"].find("origin"), "xyz") for end in ("front", "rear")
    )
    assert front[0] - rear[0] == Grip().wheelbase
    for geometry in body.iter("geometry"):
        assert {shape.tag for shape in geometry} <= {"box", "cylinder", "sphere"}
