"""What check_driver says of an IMU and of fixes, made up by hand, on a climber that circles."""

import math
from dataclasses import replace

import numpy as np
import pytest
from driven import CLIMBER, arrived, evidence, odometry
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.driver_check import checks, sensing
from climber_uk.driver_check.evidence import NO_FIXES, SensorStamps
from climber_uk.driver_check.report import Verdict
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import DEGREE, GRAVITY

PASS, WARN, FAIL, SKIP = Verdict
START, PERIOD = 2000 * SECOND, 5_000_000  # [ns]
TURN, SPEED, COUNT = 0.5, 0.2, 600  # [rad/s], [m/s]
ROWS = "imu", "gravity", "gyro", "fixes"


def circling(inclination=90.0, first=0.8, turn=TURN):
    """Evidence of a good driver with an IMU and with fixes."""
    stamps = START + PERIOD * np.arange(COUNT)
    time, random = np.arange(COUNT) * PERIOD / SECOND, np.random.default_rng(0)
    heading = first + turn * time
    radius = SPEED / TURN
    places = radius * np.stack([np.sin(heading), -np.cos(heading)], axis=1)
    heard = [
        arrived(odometry((*place, angle), (SPEED, 0.0, turn), int(stamp)))
        for place, angle, stamp in zip(places, heading, stamps, strict=True)
    ]
    seen = evidence(heard)
    pull, off_wall = (GRAVITY * f(inclination * DEGREE) for f in (math.sin, math.cos))
    force = np.stack([pull * np.sin(heading), pull * np.cos(heading) + SPEED * turn], axis=1)
    values = np.column_stack([np.zeros((COUNT, 2)), np.full(COUNT, turn), force])
    values = np.column_stack([values, np.full(COUNT, off_wall)])
    values = values + random.normal(0, 0.02, values.shape)
    fixed = slice(None, None, 20)
    noise = random.normal(0, 0.01, places[fixed].shape)
    variances = np.full((len(noise), 3), [1e-4, 1e-4, 1e4])
    return replace(
        seen,
        climber=replace(CLIMBER, inclination=inclination),
        imu=SensorStamps(stamps, stamps + 1_000_000, ["base_link"] * COUNT, values),
        fixes=SensorStamps(
            stamps[fixed],
            stamps[fixed] + 100_000_000,
            ["odom"] * len(noise),
            np.column_stack([places[fixed] + noise, variances]),
        ),
    )


def changed(sensor, spoil):
    """Evidence whose `sensor` is spoilt: its fields by a function of them."""
    seen = circling()
    told = getattr(seen, sensor)
    return replace(seen, **{sensor: told._replace(**spoil(told))})


def values(change):
    return lambda told: {"values": change(told.values.copy())}


def column(numbers, factor):
    def change(table):
        table[:, numbers] = table[:, numbers] * factor
        return table

    return values(change)


def order(*numbers):
    return values(lambda table: table[:, list(numbers)])


def axes(turn):
    both = np.kron(np.eye(2), turn)
    return values(lambda table: table @ both.T)


FORCES, PLACES = [3, 4, 5], [0, 1]
FAULTS = {
    "accelerations in g": ("imu", column(FORCES, 1 / 9.81), "imu", "in g"),
    "accelerations without gravity": ("imu", column(FORCES, 0.001), "imu", "without gravity"),
    "accelerations in another unit": ("imu", column(FORCES, 100), "imu", "of gravity's 9.81"),
    "zero stamps": ("imu", lambda told: {"stamp": 0 * told.stamp}, "imu", "stamps are zero"),
    "stamps since boot": (
        "imu",
        lambda told: {"stamp": told.stamp - START + SECOND},
        "imu",
        "behind the clock",
    ),
    "stamps that go back": ("imu", lambda told: {"stamp": told.stamp[::-1]}, "imu", "go back"),
    "not a number": ("imu", column([0], math.nan), "imu", "not finite"),
    "weight in place of what holds it": ("imu", column(FORCES, -1), "gravity", "wrong sign"),
    "turned by a quarter": ("imu", order(0, 1, 2, 4, 3, 5), "gravity", "x is its y, y is its x"),
    "y to the right": ("imu", column([4], -1), "gravity", "fits if y is its -y"),
    "z and y swapped": ("imu", axes(np.eye(3)[[0, 2, 1]]), "gravity", "y is its z, z is its y"),
    "z into the wall": ("imu", column([2], -1), "gyro", "the opposite way"),
    "degrees per second": ("imu", column([2], 57.3), "gyro", "degrees per second"),
    "turns about x": ("imu", order(2, 1, 0, 3, 4, 5), "gyro", "about its x"),
    "half as fast": ("imu", column([2], 0.5), "gyro", "0.50"),
    "late fixes": ("fixes", lambda told: {"came": told.came + 2 * SECOND}, "fixes", "behind"),
    "no variances": ("fixes", column([2, 3], 0), "fixes", "variances of x, y or yaw"),
    "centimetres": ("fixes", column(PLACES, 100), "fixes", "in centimetres"),
    "millimetres": ("fixes", column(PLACES, 1000), "fixes", "in millimetres"),
    "mirrored": ("fixes", column([1], -1), "fixes", "mirrored"),
    "x and y swapped": ("fixes", order(1, 0, 2, 3, 4), "fixes", "mirrored"),
    "turned frame": (
        "fixes",
        values(lambda table: table @ np.block([[TURNED, Z], [Z.T, np.eye(3)]])),
        "fixes",
        "turned by",
    ),
}
TURNED, Z = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.zeros((2, 3))


@pytest.mark.parametrize("inclination", [0.0, 20.0, 90.0, 180.0])
def test_a_good_imu_and_good_fixes_pass(inclination):
    found = checks.report(circling(inclination))
    assert {name: found[name].verdict for name in ROWS} == dict.fromkeys(ROWS, PASS)


@settings(max_examples=8)
@given(first=st.floats(-3, 3), inclination=st.floats(0, 180))
def test_no_heading_and_no_wall_makes_a_good_one_fail(first, inclination):
    seen = circling(inclination, first)
    assert sensing.gravity(seen).verdict is PASS


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_is_found_by_its_name_in_its_row_and_in_no_other(name):
    sensor, spoil, row, said = FAULTS[name]
    found = checks.report(changed(sensor, spoil))
    assert said in found[row].said
    assert found[row].hint
    others = {found[other].verdict for other in ROWS if other != row}
    assert found[row].verdict is FAIL
    assert others <= {PASS, SKIP}


@pytest.mark.parametrize(("sensor", "row"), [("imu", "imu"), ("fixes", "fixes")])
def test_another_frame_is_a_warning_as_it_can_be_told(sensor, row):
    found = checks.report(changed(sensor, lambda told: {"frames": ["other"] * len(told.stamp)}))
    assert found[row].verdict is WARN
    assert "'other'" in found[row].said


def test_one_that_stands_or_has_neither_is_not_said_to_be_right():
    seen = circling(turn=0.0)
    still = replace(seen, imu=seen.imu._replace(values=seen.imu.values))
    assert sensing.gyro(still).verdict is SKIP
    assert sensing.fixes(replace(seen, fixes=NO_FIXES)).verdict is SKIP
