import pytest
from rosbags.typesys import Stores, get_typestore

from climber_uk.bags.definitions import MOST_FIELDS, defined, known

STORE = get_typestore(Stores.ROS2_JAZZY)
LINE = "=" * 80
TYPES = [
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/ParameterEvent",
    "sensor_msgs/msg/Image",
]


@pytest.mark.parametrize("name", TYPES)
def test_a_type_as_a_bag_defines_it_is_that_of_jazzy(name):
    definition = STORE.generate_msgdef(name, ros_version=2)[0]
    assert defined(name, definition).fielddefs[name][1] == known(name).fielddefs[name][1]


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("A a\n" + LINE + "\nMSG: a/A\nA a", "a/msg/A contains itself"),
        ("A[] a\n" + LINE + "\nMSG: a/A\nfloat64 x\nA[] a", "a/msg/A contains itself"),
        ("\n".join(f"int8 x{i}" for i in range(500)).replace("int8", "A[99]")
         + "\n" + LINE + "\nMSG: a/A\nint8 x", f"more than {MOST_FIELDS} fields"),
        ("string[4000000000] x", "an array of 4000000000"),
        ("string[20000] x", f"more than {MOST_FIELDS} fields"),
        ("float64[4000000000] x", "an array of 4000000000"),
        ("B b", "it does not define a/msg/B"),
        ("{ no definition", "it cannot be parsed"),
        ("int8 x\nint8 x", "it cannot be parsed"),
        ("int8 x\n" + LINE + "\nMSG: a/class\nint8 import", "."),
    ],
)  # fmt: skip
def test_what_cannot_be_a_type_is_refused_in_words(definition, said):
    if said == ".":  # words of Python are names like others
        assert "a/msg/X" in defined("a/msg/X", definition).fielddefs
        return
    with pytest.raises(ValueError, match=said):
        defined("a/msg/X", definition)


def test_a_type_of_nobody_is_not_known():
    assert known("a/msg/X") is None
