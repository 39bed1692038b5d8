"""What check_driver says of odometry made up by hand."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from driven import ALONE, DRIVER, MOTOR, arrived, evidence, odometry

from climber_uk.driver_check import checks, listening, moving, report, timing
from climber_uk.driver_check.evidence import ExpectedDriver
from climber_uk.driver_check.report import Verdict
from climber_uk.mechanics import SECOND

PASS, WARN, FAIL, SKIP = Verdict
START = 2000 * SECOND  # [ns] on a computer that started 1000 s before
TURN = 0.5  # [rad/s]
SPEED = 0.2  # [m/s]


def stamps(count=200, period=5_000_000):
    return [START + number * period for number in range(count)]


def standing(stamps, **how):
    return [arrived(odometry((0.0, 0.0, 0.5), (0.0, 0.0, 0.0), stamp, **how)) for stamp in stamps]


def circling(see=lambda pose, twist: (pose, twist), count=400):
    """Evidence of a climber on a circle, as a driver that sees it in its own way tells it."""
    heard = []
    for stamp in stamps(count):
        time = (stamp - START) / SECOND
        angle, radius = 0.8 + TURN * time, SPEED / TURN
        pose = np.array([radius * math.sin(angle), -radius * math.cos(angle), angle])
        twist = np.array([SPEED, 0.0, TURN])
        heard.append(arrived(odometry(*see(pose, twist), stamp)))
    return evidence(heard)


def verdict(finding):
    return finding.verdict


def test_a_good_driver_passes_all_that_needs_no_torques():
    found = checks.report(circling())
    tried = {
        "imu",
        "gravity",
        "gyro",
        "fixes",
        "trial",
        "wheels",
        "motors",
        "gain",
        "servo",
        "turning",
        "latency",
        "watchdog",
    }
    assert {name: f.verdict for name, f in found.items()} == {
        name: SKIP if name in tried else PASS for name in checks.CHECKS
    }


def test_one_that_stands_is_not_said_to_move_rightly():
    seen = evidence(standing(stamps()))
    found = checks.report(seen)
    assert {found[name].verdict for name in ("heading", "twist", "slip")} == {SKIP}


def test_noise_of_one_that_stands_is_no_motion():
    random = np.random.default_rng(1)
    heard = [
        arrived(odometry(random.normal(0, 1e-3, 3), random.normal(0, 5e-3, 3), stamp))
        for stamp in stamps(600)
    ]
    found = checks.report(evidence(heard))
    assert {found[name].verdict for name in ("heading", "twist", "slip")} == {SKIP}


def turned(pose, twist, angle):
    cosine, sine = math.cos(angle), math.sin(angle)
    return pose, (cosine * twist[0] - sine * twist[1], sine * twist[0], twist[2])


@pytest.mark.parametrize(
    ("see", "check", "said"),
    [
        (lambda p, t: ((*p[:2], math.degrees(p[2])), t), "heading", "is in degrees"),
        (lambda p, t: (p, (t[0], 0, math.degrees(t[2]))), "heading", "degrees per second"),
        (lambda p, t: (p, (t[0], 0, -t[2])), "heading", "opposite ways"),
        (lambda p, t: (p, (t[0], 0, 0)), "heading", "twist.angular.z is zero"),
        (lambda p, t: (p, (t[0], 0, 1.5 * t[2])), "heading", "0.667 times"),
        (lambda p, t: turned(p, t, p[2]), "twist", "is in odom, not in base_link"),
        (lambda p, t: (p, (0, 0, t[2])), "twist", "twist.linear is zero"),
        (lambda p, t: (p, (-t[0], 0, t[2])), "twist", "-1 times"),
        (lambda p, t: (p, (2 * t[0], 0, t[2])), "twist", "0.5 times"),
        (lambda p, t: turned((*p[:2], p[2] - 0.3), t, 0.3), "slip", "sideways 30.9"),
    ],
)
def test_a_motion_told_wrongly_is_named(see, check, said):
    found = checks.report(circling(see))
    assert [name for name, f in found.items() if f.verdict is FAIL] == [check]
    assert said in found[check].said
    assert found[check].hint


def test_along_x_the_frame_of_the_twist_cannot_be_told():
    heard = [
        arrived(odometry((SPEED * (s - START) / SECOND, 0, 0), (SPEED, 0, 0), s)) for s in stamps()
    ]
    found = moving.twist(evidence(heard))
    assert found.verdict is WARN
    assert "the frame cannot be told" in found.said


@pytest.mark.parametrize(
    ("graph", "check", "said"),
    [
        (replace(ALONE, odometry=()), "topic", "nobody publishes /odom"),
        (replace(ALONE, odometry=(), elsewhere=("/a/odom",)), "topic", "there is /a/odom"),
        (replace(ALONE, odometry=(DRIVER._replace(kind="a/msg/B"),)), "topic", "is a/msg/B"),
        (replace(ALONE, odometry=(DRIVER, DRIVER)), "publishers", "2 publish"),
        (replace(ALONE, odometry=(DRIVER._replace(fits=False),)), "qos", "does not match"),
        (replace(ALONE, commanded=()), "commands", "nobody subscribes"),
        (replace(ALONE, commanded=(MOTOR._replace(kind="a/msg/B"),)), "commands", "is a/msg/B"),
        (replace(ALONE, commanded=(MOTOR._replace(fits=False),)), "commands", "would not get"),
    ],
)
def test_what_is_wrong_with_topics_is_named(graph, check, said):
    found = checks.report(replace(circling(), graph=graph))
    assert [name for name, f in found.items() if f.verdict is FAIL] == [check]
    assert said in found[check].said


def test_best_effort_is_a_warning():
    graph = replace(ALONE, odometry=(DRIVER._replace(reliable=False),))
    assert listening.qos(evidence([], graph=graph)).verdict is WARN


@pytest.mark.parametrize(
    ("period", "wanted"),
    [(5_000_000, PASS), (10_000_000, WARN), (100_000_000, FAIL), (500_000, FAIL)],
)
def test_rates_are_judged_by_stamps(period, wanted):
    found = timing.rate(evidence(standing(stamps(50, period))))
    assert found.verdict is wanted
    assert found.values["rate"] == pytest.approx(1e9 / period)


@pytest.mark.parametrize(("uneven", "wanted"), [(0.05, PASS), (0.3, WARN), (0.8, FAIL)])
def test_jitter_is_that_of_the_stamps(uneven, wanted):
    gap = 2 * SECOND  # of a machine that was asleep
    moved = [
        s + round(uneven * 5_000_000) * (n % 2) + gap * (n > 150) for n, s in enumerate(stamps())
    ]
    found = timing.jitter(evidence(standing(moved)))
    assert found.verdict is wanted
    assert found.values["stamps"] == pytest.approx(uneven * 0.005, rel=0.05)


def with_arrivals(wall=0, boot=0, simulated=0, stamp=0, **others):
    """Odometry with clocks that are so much [s] ahead of its stamps."""
    heard = [
        a._replace(
            wall=a.wall + round(wall * SECOND),
            boot=a.wall + round(boot * SECOND),
            simulated=a.wall + round(simulated * SECOND),
        )
        for a in standing(stamps())
    ]
    return evidence(heard, **others)


CLOCK = replace(ALONE, has_clock=True)
FAR = 1e5  # [s]


@pytest.mark.parametrize(
    ("seen", "wanted", "said"),
    [
        (with_arrivals(0.001, FAR), PASS, "the wall clock"),
        (with_arrivals(FAR, 0.001), FAIL, "time since boot"),
        (with_arrivals(FAR, 2 * FAR), FAIL, "1e+05 s behind the wall clock"),
        (with_arrivals(-FAR, 2 * FAR), FAIL, "1e+05 s ahead of the wall clock"),
        (with_arrivals(FAR, FAR, 0.0, graph=CLOCK, use_sim_time=True), PASS, "simulated time"),
        (with_arrivals(FAR, FAR, 0.0, graph=CLOCK), FAIL, "simulated time, not the wall clock"),
        (
            with_arrivals(0.0, FAR, FAR, graph=CLOCK, use_sim_time=True),
            FAIL,
            "the wall clock, not simulated time",
        ),
        (with_arrivals(0.0, FAR, use_sim_time=True), FAIL, "nobody publishes /clock"),
        (evidence(standing([0] * 20)), FAIL, "stamps are zero"),
    ],
)
def test_the_stamps_clock_is_told(seen, wanted, said):
    found = timing.clock(seen)
    assert (found.verdict, said in found.said) == (wanted, True), found.said


@pytest.mark.parametrize(
    ("age", "wanted"), [(0.001, PASS), (0.07, WARN), (0.2, FAIL), (-0.05, WARN), (-0.2, FAIL)]
)
def test_odometry_must_be_fresh(age, wanted):
    found = timing.age(with_arrivals(age))
    assert found.verdict is wanted
    assert found.values["age"] == pytest.approx(age)
    patient = ExpectedDriver(odometry_timeout=10.0)
    assert timing.age(with_arrivals(abs(age), expected=patient)).verdict is PASS


def test_stamps_must_increase_but_for_odometry_that_waits_for_torques():
    one, two, three = stamps(3)
    assert timing.order(evidence(standing([one, two, three]))).verdict is PASS
    assert timing.order(evidence(standing([one, three, two]))).verdict is FAIL
    assert timing.order(evidence(standing([one, two, two]))).verdict is FAIL
    assert timing.order(evidence(standing([one, two, two]), graph=CLOCK)).verdict is PASS


@pytest.mark.parametrize(
    ("value", "wanted"), [(1e-6, PASS), (0.0, FAIL), (-1.0, FAIL), (math.nan, FAIL)]
)
def test_covariances_must_say_something(value, wanted):
    seen = evidence(standing(stamps(), covariance=value))
    assert listening.covariance(seen).verdict is wanted


def test_a_covariance_of_the_pose_alone_is_a_warning():
    heard = standing(stamps())
    for arrival in heard:
        arrival.message.twist.covariance = np.zeros(36)
    assert listening.covariance(evidence(heard)).verdict is WARN


def test_frames_must_be_those_of_the_controller():
    heard = standing(stamps()) + standing(stamps(1), frames=("map", "base_link"))
    assert listening.frames(evidence(standing(stamps()))).verdict is PASS
    found = listening.frames(evidence(heard))
    assert found.verdict is FAIL
    assert "'map'" in found.said


def test_numbers_must_be_finite_and_orientations_turns():
    heard = standing(stamps())
    heard[7].message.pose.pose.position.x = math.nan
    found = listening.finite(evidence(heard))
    assert (found.verdict, found.said[:18]) == (FAIL, "1 of 200 messages:")
    heard[7].message.pose.pose.position.x = 0.0
    heard[7].message.pose.pose.orientation.w = 0.0
    assert "sin(θ/2)" in listening.finite(evidence(heard)).hint


def test_what_follows_from_a_fault_is_not_looked_at():
    found = checks.report(evidence(standing(stamps(3)), graph=replace(ALONE, commanded=())))
    assert [name for name, f in found.items() if f.verdict is FAIL] == ["commands", "rate"]
    assert found["jitter"].said == "first mend rate"
    assert found["slip"].said == "first mend rate"
    assert not checks.may_move(found)


def test_a_report_can_be_read_by_man_and_machine():
    found = checks.report(replace(circling(), graph=replace(ALONE, odometry=())))
    text = report.as_text(found).splitlines()
    assert text[0].split() == ["fail", "topic", "nobody", "publishes", "/odom"]
    assert text[1].strip().startswith("→ start the driver")
    assert text[-1] == "1 fail, 26 skip"
    table = json.loads(report.as_json(found))
    assert table["ok"] is False
    assert table["rows"][0]["check"] == "topic"
    assert table["rows"][0]["verdict"] == "fail"
    assert not report.has_failed({"a": report.warned("", ""), "b": report.skipped("")})
