"""Odometry that is odd: what of it is used, and what is left out, with its reason."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_bag import ODOMETRY, RADIUS, RATE, SECOND, STORE, Made, a_run, turn

from climber_uk.bags.batches import decode
from climber_uk.bags.extraction import FAULTS, heading
from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.reading import heading_of
from climber_uk.report.metrics import Case, evaluate

N = 60
NAN = math.nan


def spoilt(change, chosen=range(N)):
    made = a_run(N)
    for number, (topic, _, _, sent) in enumerate(m for m in made.messages if m[0] == "/odom"):
        assert topic == "/odom"
        if number in chosen:
            change(sent)
    return made


def scaled(factor):
    def change(sent):
        q = sent.pose.pose.orientation
        q.x, q.y, q.z, q.w = (factor * part for part in (q.x, q.y, q.z, q.w))

    return change


def rolled(angle):
    """Turned about its own forward axis, on top of its heading."""

    def change(sent):
        q, half = sent.pose.pose.orientation, angle / 2
        z, w = q.z, q.w
        q.x, q.y = w * math.sin(half), z * math.sin(half)
        q.z, q.w = z * math.cos(half), w * math.cos(half)

    return change


def setting(path, value):
    def change(sent):
        *above, last = path.split(".")
        for name in above:
            sent = getattr(sent, name)
        setattr(sent, last, value)

    return change


USED = {
    "a norm of 1.002": scaled(1.002),
    "a norm of 0.9985": scaled(0.9985),
    "a norm of 1.0099": scaled(1.0099),
    "a norm of 0.9901": scaled(0.9901),
    "the other quaternion": scaled(-1.0),
    "8° of roll": rolled(math.radians(8)),
    "no height": setting("pose.pose.position.z", NAN),
    "no climb": setting("twist.twist.linear.z", NAN),
    "no roll rate": setting("twist.twist.angular.x", NAN),
    "no covariance": setting("pose.covariance", np.full(36, NAN)),
    "no covariance of the twist": setting("twist.covariance", np.full(36, math.inf)),
    "no speed": setting("twist.twist.linear.x", NAN),
    "no speed to a side": setting("twist.twist.linear.y", math.inf),
    "no yaw rate": setting("twist.twist.angular.z", NAN),
    "an absurd speed": setting("twist.twist.linear.x", 1e9),
}


@pytest.mark.parametrize("change", USED.values(), ids=USED)
def test_what_does_not_matter_costs_nothing(tmp_path, change):
    (run,), said = read_runs(spoilt(change).write(tmp_path / "bag"), Topics())
    assert said == []
    got = evaluate(Case(run))
    assert (got["odometry_count"], got["odometry_unfit"]) == (N, 0)
    assert got["max_distance"] < 1e-9
    assert got["max_heading"] < 1e-9
    assert got["travelled"] == pytest.approx(RADIUS * RATE * (N - 1) * 0.005, rel=1e-3)


LEFT_OUT = {
    "position": (setting("pose.pose.position.x", NAN), FAULTS[2]),
    "far": (setting("pose.pose.position.y", -2e6), FAULTS[2]),
    "orientation": (setting("pose.pose.orientation.w", NAN), FAULTS[3]),
    "norm": (scaled(1.0101), FAULTS[4]),
    "zero": (scaled(0.0), FAULTS[4]),
    "tilted": (rolled(math.radians(12)), FAULTS[5]),
}


@pytest.mark.parametrize(("change", "why"), LEFT_OUT.values(), ids=LEFT_OUT)
def test_what_is_left_out_is_told_with_its_number_and_its_reason(tmp_path, change, why):
    (run,), said = read_runs(spoilt(change, range(20, 27)).write(tmp_path / "some"), Topics())
    assert said == [f"/odom: 7 of 60 messages left out: {why} (7)"]
    got = evaluate(Case(run))
    assert (got["odometry_count"], got["odometry_unfit"]) == (N - 7, 7)
    assert got["max_distance"] < 1e-9
    with pytest.raises(ValueError, match=f"60 of 60 messages left out: {why[:20]}") as refusal:
        read_runs(spoilt(change).write(tmp_path / "all"), Topics())
    assert f"({N})" in str(refusal.value)
    assert str(refusal.value).endswith("no run on /odom: no message of use")


def test_each_reason_is_counted(tmp_path):
    def change(sent):
        place = round(sent.header.stamp.nanosec / 5e6)
        (scaled(1.5) if place < 10 else setting("pose.pose.position.x", NAN))(sent)

    _, said = read_runs(spoilt(change, range(15)).write(tmp_path / "bag"), Topics())
    assert said == [f"/odom: 15 of 60 messages left out: {FAULTS[2]} (5), {FAULTS[4]} (10)"]


@settings(deadline=None)
@given(
    parts=st.lists(
        st.one_of(
            st.floats(-1.02, 1.02), st.sampled_from([0.0, -0.0, 1.0, math.nan, math.inf, 1e300])
        ),
        min_size=4,
        max_size=4,
    )
)
def test_many_orientations_are_judged_as_the_controller_judges_one(parts):
    sent = STORE.types["geometry_msgs/msg/Quaternion"](*parts)
    kind = "geometry_msgs/msg/QuaternionStamped"
    stamped = STORE.types[kind](
        quaternion=sent,
        header=STORE.types["std_msgs/msg/Header"](
            stamp=STORE.types["builtin_interfaces/msg/Time"](0, 0), frame_id=""
        ),
    )
    (batch,), _ = decode([(0, bytes(STORE.serialize_cdr(stamped, kind)))], kind, STORE)
    (found,), (fault,) = heading(batch, "quaternion")
    try:
        expected = heading_of(sent.x, sent.y, sent.z, sent.w)
    except ValueError:
        assert fault
    else:
        assert not fault
        assert found == pytest.approx(expected, abs=1e-12)


def test_one_odometry_message_is_no_run(tmp_path):
    made = Made(1)
    made.add_odometry()
    made.add_reference(0.0, 0.1)
    with pytest.raises(ValueError, match=r"/bag: no run on /odom: 1 message of use$"):
        read_runs(made.write(tmp_path / "bag"), Topics())


def test_stamps_that_stand_still_are_no_run(tmp_path):
    """A driver that never sets them."""
    made = a_run(N)
    made.edit("odom", setting("header.stamp", STORE.types["builtin_interfaces/msg/Time"](0, 0)))
    said = r"/bag: no run on /odom: 1 message of use, 59 with the stamp of another$"
    with pytest.raises(ValueError, match=said):
        read_runs(made.write(tmp_path / "bag"), Topics())


def test_one_odometry_message_with_a_reference_is_no_run(tmp_path):
    made = Made(N)
    made.add_odometry()
    made.add_reference(0.1975, 0.1975)
    made.messages = [m for m in made.messages if m[0] == "/odom"] + made.messages[-1:]
    last = made.messages[-1][3]
    last.points = last.points[:2]
    last.points[1].time_from_start.nanosec = 4_000_000
    with pytest.raises(ValueError, match="one message only has a reference"):
        read_runs(made.write(tmp_path / "bag"), Topics())


def pose_only(n=400, value=0.0):
    made = Made(n)
    made.add_odometry()
    for axis in ("linear.x", "linear.y", "angular.z"):
        made.edit("odom", setting(f"twist.twist.{axis}", value))
    return made


@pytest.mark.parametrize("value", [0.0, NAN])
def test_without_a_twist_speeds_are_those_of_the_poses(tmp_path, value):
    made = pose_only(value=value)
    made.add_torques()
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    got = evaluate(Case(replace(run, parameters=vars(Climber()))))
    assert said == []
    np.testing.assert_allclose(run.rates, np.tile([1.0, 0.0, RATE], (400, 1)), atol=1e-3)
    assert got["travelled"] == pytest.approx(RADIUS * RATE * 399 * 0.005, rel=1e-4)
    turning = 0.3 * RATE
    assert got["mean_power_right"] == pytest.approx((1 + turning) / 0.027, rel=1e-3)
    assert got["max_side_slip"] < 1e-3


def test_a_yaw_rate_that_is_not_filled_in_is_that_of_the_poses(tmp_path):
    made = Made(400)
    made.add_odometry()
    made.edit("odom", setting("twist.twist.angular.z", 0.0))
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    np.testing.assert_allclose(run.rates[:, 2], RATE, rtol=1e-6)
    assert (run.rates[:, :2] == [1.0, 0.0]).all()


def test_a_climber_that_stands_has_not_travelled_whatever_its_odometry_tells(tmp_path):
    made = pose_only()
    made.edit("odom", setting("pose.pose.position.x", 1.0))
    made.edit("odom", setting("pose.pose.position.y", 1.0))
    made.edit("odom", setting("pose.pose.orientation", turn(0.5)))
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    assert evaluate(Case(run))["travelled"] == 0.0


WAY = RADIUS * RATE * 799 * 0.005  # [m] of 800 messages


@pytest.mark.parametrize("scale", [0.0625, 0.5, 2.0, -3.0, 1e6], ids=str)
def test_a_twist_that_contradicts_the_poses_is_said_and_makes_no_way(tmp_path, scale):
    made = a_run(800)
    made.edit("odom", lambda sent: setattr(sent.twist.twist.linear, "x", scale))
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert evaluate(Case(run))["travelled"] == pytest.approx(WAY, rel=0.01)
    (line,) = said
    assert line.startswith("/odom: its speeds make a way of ")
    assert line.endswith(f"m, its poses one of {run.travelled:.4g} m")


@pytest.mark.parametrize(
    ("field", "factor", "line"),
    [
        ("linear.x", -1.0, "linear.x is -1 times the rate of its poses"),
        ("angular.z", 57.3, "angular.z is 57.3 times the rate of its poses"),
        ("angular.z", -1.0, "angular.z is -1 times the rate of its poses"),
    ],
)
def test_a_twist_of_another_sign_or_unit_is_said(tmp_path, field, factor, line):
    made = a_run(800)
    part, axis = field.split(".")

    def change(sent):
        rates = getattr(sent.twist.twist, part)
        setattr(rates, axis, factor * getattr(rates, axis))

    made.edit("odom", change)
    _, said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert said == [f"/odom: {line}"]


def test_a_twist_that_is_not_finite_now_and_then_is_counted(tmp_path):
    made = a_run(800)
    odometry = [sent for topic, *_, sent in made.messages if topic == "/odom"]
    for sent in odometry[10:20]:
        sent.twist.twist.linear.x = NAN
    _, said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert said == ["/odom: linear.x is not finite in 10 of 800 messages"]


def test_one_speed_that_cannot_be_makes_no_way(tmp_path):
    made = a_run(800)
    odometry = [sent for topic, *_, sent in made.messages if topic == "/odom"]
    odometry[400].twist.twist.linear.x = 1e6
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert run.travelled == pytest.approx(WAY, rel=0.01)
    assert "its speeds make a way of" in said[0]


@pytest.mark.parametrize("gap", [0.3, 1.0, 3.0])
def test_over_a_gap_the_way_is_straight(tmp_path, gap):
    made = a_run(800)
    stamps = sorted(
        {
            sent.header.stamp.sec + sent.header.stamp.nanosec / SECOND
            for topic, *_, sent in made.messages
            if topic == "/odom"
        }
    )
    lacks = stamps[40] + gap
    made.messages = [
        message
        for message in made.messages
        if message[0] != "/odom"
        or not stamps[40]
        < message[-1].header.stamp.sec + message[-1].header.stamp.nanosec / SECOND
        < lacks
    ]
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    chord = 2 * RADIUS * math.sin(RATE * gap / 2)
    assert run.travelled == pytest.approx(WAY - RADIUS * RATE * gap + chord, abs=0.01)


def test_poses_with_noise_make_the_way_no_longer(tmp_path):
    """1 mm of it, 200 times a second: 0.4 m/s were each step counted."""
    made = pose_only(2001)
    random = np.random.default_rng(1)
    for *_, sent in made.messages:
        sent.pose.pose.position.x += random.normal(0, 1e-3)
        sent.pose.pose.position.y += random.normal(0, 1e-3)
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    got = evaluate(Case(run))
    assert got["travelled"] == pytest.approx(RADIUS * RATE * 10, rel=2e-3)
    assert math.isnan(got["slip_share"])  # it would be told if there were some


def test_seconds_are_not_lost_where_time_is_long(tmp_path):
    """Stamps of the wall clock, of which a float holds no nanoseconds."""
    made = a_run(N)
    for *_, sent in made.messages:
        sent.header.stamp.sec += 1_700_000_000
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    np.testing.assert_allclose(run.time, made.time, atol=1e-9)
    assert run.start > 1_700_000_000 * SECOND
    assert (made.messages[0][1], run.distance.max() < 1e-9) == (ODOMETRY, True)


def test_a_twist_along_the_axes_of_the_wall_is_said_and_makes_no_way(tmp_path):
    made = a_run(800)
    headings = iter(made.pose[:, 2])

    def to_the_wall(sent):
        speed, heading = sent.twist.twist.linear, next(headings)
        speed.x, speed.y = speed.x * np.cos(heading), speed.x * np.sin(heading)

    made.edit("odom", to_the_wall)
    (run,), (line,) = read_runs(made.write(tmp_path / "bag"), Topics())
    assert evaluate(Case(run))["travelled"] == pytest.approx(WAY, rel=0.01)
    assert line == "/odom: linear.x and linear.y are along the wall's axes, not the climber's"
