"""Numbers in another unit are doubted, and the one that is meant is told; ours are not."""

from pathlib import Path

import pytest

from climber_uk.closed_loop.node_parameters import PARAMETERS
from climber_uk.parameters.parameter_file import read_sections
from climber_uk.parameters.plausibility import doubt

CONFIG = Path(__file__).parents[2] / "config"
FIELDS = {name.partition(".")[2]: field for name, field in PARAMETERS.items()}


@pytest.mark.parametrize(
    ("name", "value", "meant"),
    [
        ("wheel_radius", 27.0, "mm, write 0.027"),
        ("wheel_radius", 2.7, "cm, write 0.027"),
        ("half_track", 300.0, "mm, write 0.3"),
        ("half_track", 30.0, "cm, write 0.3"),
        ("mass", 5000.0, "g, write 5"),
        ("yaw_inertia", 3300.0, "kg cm², write 0.33"),
        ("suction_pressure", 8.0, "kPa, write 8000"),
        ("suction_pressure", 80.0, "mbar, write 8000"),
        ("suction_pressure", 0.08, "bar, write 8000"),
        ("suction_area", 600.0, "cm², write 0.06"),
        ("suction_area", 60000.0, "mm², write 0.06"),
        ("inclination", 1.5708, "rad, write 90"),
        ("max_wheel_torque", 4000.0, "N mm, write 4"),
        ("no_load_wheel_rate", 3000.0, "turns a minute, write 314.2"),
        ("initial_heading", 45.0, "deg, write 0.7854"),
        ("initial_heading", -90.0, "deg, write -1.571"),
        ("initial_x", 3000.0, "mm, write 3"),
        ("centre_height", 50.0, "mm, write 0.05"),
        ("wheelbase", 25.0, "cm, write 0.25"),
        ("odometry_timeout", 100.0, "ms, write 0.1"),
        ("least_pressure", 5.0, "kPa, write 5000"),
        ("ellipse.semi_axis_x", 10000.0, "mm, write 10"),
    ],
)
def test_a_number_in_another_unit_is_doubted_and_the_one_meant_is_told(name, value, meant):
    assert doubt(FIELDS[name], value).endswith(f"; if it is in {meant}")


@pytest.mark.parametrize("name", FIELDS)
def test_defaults_and_zero_are_not_doubted(name):
    field = FIELDS[name]
    assert doubt(field, field.default) == ""
    if not isinstance(field.default, str | bool):
        assert doubt(field, 0.0) == ""


@pytest.mark.parametrize(
    "path",
    sorted({*CONFIG.glob("*.yaml")} - {CONFIG / "campaign.yaml", CONFIG / "rosbag2_qos.yaml"}),
    ids=lambda path: path.stem,
)
def test_our_own_files_are_not_doubted(path):
    values = [item for section in read_sections(path) for item in section.values.items()]
    assert not [name for name, value in values if name in FIELDS and doubt(FIELDS[name], value)]


def test_a_number_without_another_unit_is_doubted_alone():
    said = "seal_friction_coefficient=30 is hardly meant (usual: 0.01 to 3)"
    assert doubt(FIELDS["seal_friction_coefficient"], 30.0) == said
