"""Metrics against values by hand, of bags whose errors are known in closed form."""

import math
import re

import numpy as np
import pytest
from made_bag import JOINTS, RADIUS, RATE, START, Made, a_run, message

from climber_uk.bags.events import is_fault
from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.control.safety import Mode
from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.report.figures import draw
from climber_uk.report.grip import grip_asked
from climber_uk.report.metrics import GROUPS, METRICS, Case, evaluate
from climber_uk.report.page import page
from climber_uk.report.tables import Column, text

EXACT = {"rel": 1e-9, "abs": 1e-12}
UNITS = {"", "%", "m", "rad", "s", "m/s", "1/s", "N", "N m", "W", "J", "J/m", "Pa"}


def metrics_of(made, path, climber=None, settled=0.01):
    parameters = (lambda _: vars(climber)) if climber else None
    (run,) = read_runs(made.write(path / "bag"), Topics(), parameters=parameters)[0]
    return evaluate(Case(run, settled))


def same(got, **expected):
    assert {name: got[name] for name in expected} == pytest.approx(expected, **EXACT)


def test_tracking_errors_are_those_by_hand(tmp_path):
    """Along a ramp up to c, across b + B sin of 10 whole swings, heading h throughout."""
    n, c, b, B, h = 400, 0.03, 0.002, 0.001, 0.004

    def errors(time):
        k = np.arange(n)
        across = b + B * np.sin(2 * np.pi * 10 * k / n)
        return np.stack([c * k / (n - 1), across, np.full(n, h)], axis=1)

    made = Made(n, errors=errors)
    made.add_odometry()
    made.add_reference()
    got = metrics_of(made, tmp_path)
    ramp, swing = c**2 * (2 * n - 1) / (6 * (n - 1)), b**2 + B**2 / 2
    same(
        got,
        rms_along_track=math.sqrt(ramp),
        p50_along_track=c / 2,
        p95_along_track=0.95 * c,
        p99_along_track=0.99 * c,
        max_along_track=c,
        rms_cross_track=math.sqrt(swing),
        max_cross_track=b + B,  # each swing has 40 samples, and one of them its top
        p50_cross_track=b,
        rms_distance=math.sqrt(ramp + swing),
        ape_rmse=math.sqrt(ramp + swing),
        end_distance=math.hypot(c, b + B * math.sin(-2 * np.pi * 10 / n)),
        **{f"{statistic}_heading": h for statistic in ("rms", "p50", "p95", "p99", "max")},
        duration=(n - 1) * 0.005,
        travelled=RADIUS * RATE * (n - 1) * 0.005,
    )
    assert math.isnan(got["settling_time"])


def test_errors_fixed_in_the_references_frame_drift_as_it_turns(tmp_path):
    """d in a frame that turns by RATE in a second: |(R - 1) d| = 2 sin(RATE/2) |d|."""
    a, b = 0.003, -0.004
    made = Made(801, errors=lambda time: np.tile([a, b, 0.0], (len(time), 1)))
    made.add_odometry()
    made.add_reference()
    got = metrics_of(made, tmp_path)
    same(
        got,
        ape_rmse=0.005,
        ape_mean=0.005,
        rpe_rmse=2 * math.sin(RATE / 2) * 0.005,
        settling_time=0.0,
        p99_distance=0.005,
    )
    assert got["ape_std"] == pytest.approx(0, abs=1e-12)
    assert got["rpe_rotation_rmse"] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("settled", "expected"), [(0.01, 1.505), (0.002, 1.905), (0.5, 0.0)])
def test_it_has_settled_when_the_distance_stays_small(tmp_path, settled, expected):
    """Distance 1 cm per half a second left until 2 s."""
    made = Made(401, errors=lambda time: np.outer(0.02 * (2 - time), [1.0, 0, 0]))
    made.add_odometry()
    made.add_reference()
    got = metrics_of(made, tmp_path, settled=settled)
    assert got["settling_time"] == pytest.approx(expected, abs=1e-9)


def test_torques_power_and_energy_are_those_by_hand(tmp_path):
    def torques(time, _):
        return np.stack(
            [1.0 + 0.5 * np.sin(2 * np.pi * 10 * np.arange(400) / 400), -2 + 0 * time], 1
        )

    made = Made(torques=torques)
    made.add_odometry()
    made.add_torques()
    made.add_joints(rates=[3.0, -4.0], torques=[1.5, 2.0])
    made.add_forces(np.tile([30.0, -40.0, 0.5], (400, 1)))
    got = metrics_of(made, tmp_path, Climber(max_wheel_torque=1.5))
    lasted = 399 * 0.005
    same(
        got,
        rms_torque=math.sqrt((1 + 0.5**2 / 2 + 4) / 2),
        peak_torque=2.0,
        saturation=100.0,
        peak_power_right=4.5,
        mean_power_right=4.5,
        energy_right=4.5 * lasted,
        peak_power_left=8.0,
        mean_power_left=-8.0,
        energy_left=-8.0 * lasted,
        energy_per_metre=-3.5 / (RADIUS * RATE),
        peak_constraint_lateral=40.0,
        rms_constraint_drive=30.0,
        rms_constraint_moment=0.5,
    )


def test_without_joint_states_the_power_is_that_of_the_odometry(tmp_path):
    made = Made(torques=lambda time, _: np.tile([1.0, 2.0], (len(time), 1)))
    made.add_odometry()
    made.add_torques()
    climber = Climber()
    got = metrics_of(made, tmp_path, climber)
    v, turning, r = RADIUS * RATE, 0.3 * RATE, 0.027
    same(got, peak_power_right=(v + turning) / r, mean_power_left=2 * (v - turning) / r)
    (run,), _ = read_runs(tmp_path / "bag", Topics())
    assert math.isnan(evaluate(Case(run))["peak_power_right"])  # the radius is not known


def test_friction_is_what_torques_and_weight_leave_of_the_momentum(tmp_path):
    """At a steady speed, torques that overcome weight and 12 N of friction."""
    climber, f = Climber(), 12.0
    weight = climber.mass * GRAVITY

    def torques(_, pose):
        return np.repeat(0.027 / 2 * (f + weight * np.sin(pose[:, 2:])), 2, axis=1)

    made = Made(1000, torques=torques)
    made.add_odometry()
    made.add_torques()
    same(metrics_of(made, tmp_path, climber), friction=f)


def test_friction_of_a_climber_that_backs_is_positive_too(tmp_path):
    climber, f = Climber(inclination=0.0), 12.0
    made = Made(1000, torques=lambda time, _: np.full((len(time), 2), -0.027 / 2 * f), speed=-1.0)
    made.add_odometry()
    made.add_torques()
    same(metrics_of(made, tmp_path, climber), friction=f)


def test_margins_are_the_lowest_and_the_share_below_one(tmp_path):
    made = Made()
    made.add_odometry()
    made.add_vectors("plant_simulator/margins", [[0.5, 7, 90], [2, 6, 80], [3, 8, 85], [4, 9, 99]])
    made.add_vectors("uk_torque_controller/margins", [[0.1, 1, 10]])  # an estimate
    got = metrics_of(made, tmp_path)
    same(got, lowest_slip_margin=0.5, slip_share=25.0, lowest_tip_margin=6, lowest_wheel_load=80)


@pytest.mark.parametrize(("tilt", "pulls_left"), [(0.0, np.cos), (90.0, np.sin)])
def test_the_grip_that_is_asked_of_each_wheel_is_that_by_hand(tmp_path, tilt, pulls_left):
    """The norm of the share is 1 over the slip margin, without which nothing is drawn."""
    made = Made(torques=lambda time, _: np.tile([0.4, -0.2], (len(time), 1)))
    made.add_odometry()
    made.add_torques()
    made.add_forces(np.tile([7.0, 20.0, 1.0], (400, 1)))
    made.add_parameters(**vars(Climber()), **{"plane.tilt": tilt})
    (run,), _ = read_runs(made.write(tmp_path / "bare"), Topics())
    assert not len(grip_asked(run))
    made.add_vectors("plant_simulator/margins", np.tile([1.0, 7.0, 79.5], (400, 1)).tolist())
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    asked, held = grip_asked(run), Attachment()
    assert asked.shape == (400, 2, 2)
    for (right, left), heading in zip(asked[::50], made.pose[::50, 2], strict=True):
        across, forces = -49.05 * pulls_left(heading), (0.4 / 0.027, -0.2 / 0.027)
        margin = held.slip_margin(Climber(), 0.0, forces, 20.0, across)
        assert 1 / max(np.hypot(*right), np.hypot(*left)) == pytest.approx(margin, rel=1e-3)
    assert tilt == 0.0 or "grip" in draw([("", run)])


def test_latency_and_its_jitter_are_those_by_hand(tmp_path):
    """1.00, 1.01 … 1.99 ms, over and over."""
    made = Made()
    made.add_odometry()
    made.add_torques(latency=lambda i: 1_000_000 + i % 100 * 10_000)
    same(
        metrics_of(made, tmp_path),
        latency_p50=1.495e-3,
        latency_max=1.99e-3,
        latency_jitter=1e-5 * math.sqrt((100**2 - 1) / 12),
        odometry_period=0.005,
        odometry_jitter=0.0,
    )


def test_what_is_missing_repeated_late_or_unfit_is_counted(tmp_path):
    made = Made(100)
    made.pose[50, 0] = math.nan
    made.pose[60, 1] = 1e9
    made.add_odometry([*range(10), *range(13, 100), 20, 21])
    made.add_torques([i for i in range(5, 95) if i not in (30, 31, 32)])
    for i, (topic, kind, log_time, sent) in enumerate(made.messages):
        if topic == "/odom" and sent.header.stamp.nanosec == made.stamps[80] % 10**9:
            made.messages[i] = topic, kind, log_time + 12_000_000, sent  # after two others
    got = metrics_of(made, tmp_path)
    same(
        got,
        odometry_count=95.0,
        odometry_unrecorded=3.0,  # 10, 11, 12, which torques answer
        odometry_lost=2.0,  # those that are unfit
        odometry_unfit=2.0,
        odometry_repeated=2.0,
        odometry_late=1.0,
        odometry_unanswered=3.0,
    )


def test_what_a_recorder_lost_is_told_from_what_never_came(tmp_path):
    """The controller answers what it got; of one with stamps of its own, nothing is known."""
    there = [i for i in range(100) if i not in (20, 21, 22, 40, 41, 60)]
    for name, off, unrecorded in (("answers", 0, 3.0), ("own stamps", 1, 0.0)):
        made = Made(100)
        made.add_odometry(there)
        made.add_torques([i for i in range(100) if i not in (40, 41, 60)])
        for _, kind, _, sent in made.messages:
            if kind == JOINTS:
                sent.header.stamp.nanosec += off
        got = metrics_of(made, tmp_path / name)
        same(got, odometry_lost=6.0 - unrecorded, odometry_unrecorded=unrecorded)


def test_modes_give_stops_and_the_share_that_was_followed(tmp_path):
    made = Made(401)  # 2 s
    made.add_odometry()
    modes = (0.0, "following"), (0.5, "no odometry"), (0.6, "no odometry"), (1.0, "following")
    for time, mode in (*modes, (1.5, "the reference begins later")):
        made.add_mode(time, mode, level=2 if mode == "no odometry" else 0)
    made.add_mode(1.9, "the reference begins later", level=3)  # stale
    made.add_log(0.5, 30, "safe output: no odometry")
    made.add_log(0.7, 20, "not worth a word")
    got = metrics_of(made, tmp_path)
    same(got, following=50.0, safety_stops=1.0, errors=2.0)
    (run,), _ = read_runs(tmp_path / "bag", Topics())
    told = [(time, event.kind, event.text) for time, event in run.events]
    assert told == [
        (0.0, "mode", "following"),
        (0.5, "state", "no odometry"),
        (0.5, "mode", "no odometry"),
        (0.5, "log", "safe output: no odometry"),
        (1.0, "state", "ok"),
        (1.0, "mode", "following"),
        (1.5, "mode", "the reference begins later"),
        (1.9, "state", "the reference begins later"),
    ]


def test_how_far_it_truly_was_is_told_by_the_ground_truth(tmp_path):
    """The odometry says that it is on its path; the truth is c to the left, and b in the middle."""
    n, b, c = 401, 0.05, 0.03
    made = a_run(n)
    aside = np.where(np.arange(n) == 200, b, c)
    truth = made.pose.copy()
    truth[:, 0] -= aside * np.sin(truth[:, 2])
    truth[:, 1] += aside * np.cos(truth[:, 2])
    made.add_truth(truth)
    got = metrics_of(made, tmp_path)
    assert got["max_distance"] < 1e-9
    same(
        got,
        truth_rms_distance=math.sqrt(((n - 1) * c**2 + b**2) / n),
        truth_max_distance=b,
    )
    assert list(GROUPS["Tracking"])[:2] == [
        METRICS["truth_rms_distance"],
        METRICS["truth_max_distance"],
    ]


def test_a_truth_in_another_frame_is_not_used_and_said(tmp_path):
    made = a_run()
    made.add_truth(made.pose, frame="vicon")
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert math.isnan(evaluate(Case(run))["truth_rms_distance"])
    assert said == ["/ground_truth: not used, frame_id='vicon' is not the odometry's, 'odom'"]


def test_a_reference_in_another_frame_is_not_used_and_said(tmp_path):
    made = a_run()
    made.edit("reference", lambda sent: setattr(sent.header, "frame_id", "map"))
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert np.isnan(run.reference).all()
    assert said == ["/reference: not used, frame_id='map' is not the odometry's, 'odom'"]


def sagging(made, speed, stretch):
    """Poses that sag down the wall in a stretch of time, more than it goes forwards."""
    pose = made.pose.copy()
    pose[:, 1] -= speed * np.clip(made.time - stretch[0], 0, stretch[1] - stretch[0])
    return pose


@pytest.mark.parametrize("told_by", ["odometry", "truth"])
def test_that_it_slips_sideways_is_seen_by_the_way_it_goes(tmp_path, told_by):
    """Wheels that stand on a wall while it sags at 5 cm/s for a second of four."""
    made = Made(801, speed=0.0)
    made.pose[:] = [1.0, 2.0, 0.0]
    sags = sagging(made, 0.05, (1.0, 2.0))
    if told_by == "odometry":
        made.pose = sags
    made.add_odometry()
    if told_by == "truth":
        made.add_truth(sags)
    made.add_vectors("plant_simulator/margins", [[3.0, 9.0, 80.0]] * 801)
    got = metrics_of(made, tmp_path)
    assert got["slip_share"] == pytest.approx(25.0, abs=4.0)
    assert got["max_side_slip"] == pytest.approx(0.05)


def test_what_goes_round_without_slip_does_not_slip(tmp_path):
    made = Made(801)
    made.add_odometry()
    made.add_truth(made.pose)
    got = metrics_of(made, tmp_path)
    assert got["slip_share"] == 0.0
    assert got["max_side_slip"] < 1e-9


def test_chatter_is_told_by_reversals_and_changes_of_the_torque(tmp_path):
    """Right: ± 1 N m by turns, a tick each; left: 3 N m, and a ripple that is no reversal."""
    n = 401
    sign = (-1.0) ** np.arange(n)
    ripple = 0.002

    def torques(time, _):
        return np.stack([sign, np.where(time < 1.0, 3.0, ripple * sign)], axis=1)

    made = Made(n, torques=torques)
    made.add_odometry()
    made.add_torques()
    got = metrics_of(made, tmp_path, Climber(max_wheel_torque=5.0))
    step, changes = 3.0 - ripple, n - 1
    ripples = 200 * (2 * ripple) ** 2
    same(
        got,
        torque_reversals=200.0,
        rms_torque_change=math.sqrt((changes * 4 + step**2 + ripples) / (2 * changes)),
    )


def test_a_change_of_the_torque_over_a_gap_is_none(tmp_path):
    made = Made(100, torques=lambda time, _: np.repeat(np.floor(4 * time)[:, None], 2, axis=1))
    made.add_odometry()
    made.add_torques([*range(45), *range(55, 100)])  # it rises by 1 at 50
    same(metrics_of(made, tmp_path), rms_torque_change=0.0, torque_reversals=0.0)


@pytest.mark.parametrize(
    ("modes", "stops"),
    [  # each of them an error too
        ([(-0.5, "no clock"), (0.0, "following")], 0),
        ([(-0.5, "no odometry"), (-0.1, "waiting for a reference"), (0.0, "following")], 0),
        ([(0.2, "no clock"), (0.4, "following")], 0),
        ([(0.0, "no clock"), (0.0, "following")], 0),  # at the first time that there is
        ([(0.0, "no clock"), (0.1, "following"), (0.5, "no clock"), (0.6, "following")], 1),
        ([(-0.5, "bad odometry"), (0.5, "following")], 1),
        ([(0.0, "following"), (0.5, "no odometry"), (0.6, "following"), (0.7, "bad odometry")], 2),
    ],
)
def test_to_start_up_without_a_clock_is_no_safety_stop(tmp_path, modes, stops):
    made = Made(201)
    made.add_odometry()
    for time, mode in modes:
        text = Mode.NO_CLOCK.value if mode == "no clock" else mode
        made.add_mode(time, text, level=2 if is_fault(text) else 0)
    same(metrics_of(made, tmp_path), safety_stops=float(stops), errors=float(stops))


@pytest.mark.parametrize(("adhesion", "lowest"), [("suction", 8000.0), ("magnetic", math.nan)])
def test_what_no_suction_holds_has_no_lowest_pressure(tmp_path, adhesion, lowest):
    made = Made()
    made.add_odometry()
    made.add_parameters(adhesion=adhesion)
    for stamp in made.stamps:
        kind = "sensor_msgs/msg/FluidPressure"
        told = message(kind, stamp, fluid_pressure=8000.0)
        made.add("suction_pressure", kind, made.arrival(stamp), told)
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    column = Column("a", "bag", Case(run))
    assert column.values["lowest_pressure"] == pytest.approx(lowest, nan_ok=True)
    told = "\n".join([text([column]), page("a", [column], {})])
    assert bool(re.search("pressure|suction|seal", told)) == (adhesion == "suction")


def test_what_a_pump_that_is_given_a_setpoint_saves_is_that_by_hand(tmp_path):
    """4 kPa of 8 kPa for the first half, then a ramp up to all of it; at a steady speed."""
    made = Made(401)
    made.add_odometry()
    made.add_parameters(suction_pressure=8000.0)
    for stamp, pressure in zip(made.stamps, np.linspace(0.0, 8000.0, 401), strict=True):
        kind = "sensor_msgs/msg/FluidPressure"
        for topic in "suction_pressure", "suction_setpoint":
            told = message(kind, stamp, fluid_pressure=max(float(pressure), 4000.0))
            made.add(topic, kind, made.arrival(stamp), told)
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    got = evaluate(Case(run))
    full = Climber(suction_pressure=8000.0).seal_friction * RADIUS * RATE * 400 * 0.005
    same(got, mean_suction=62.5, seal_work_share=62.5, seal_work=0.625 * full)


def test_without_a_reference_all_else_is_told(tmp_path):
    made = Made()
    made.add_odometry()
    made.add_torques()
    got = metrics_of(made, tmp_path)
    same(got, peak_torque=1.0, duration=399 * 0.005, latency_p50=1e-3)
    unknown = {name for name, value in got.items() if math.isnan(value)}
    assert {"rms_distance", "rms_heading", "ape_rmse", "rpe_rmse", "settling_time"} <= unknown


def test_where_no_preview_reaches_there_is_no_reference(tmp_path):
    made = Made(1001)  # 5 s
    made.add_odometry()
    made.add_reference(0.0, 0.5)
    made.add_reference(3.0, 4.0)
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    known = np.isfinite(run.distance)
    assert run.start == START
    covered = (run.time <= 1.5 + 1e-9) | (run.time >= 3.0 - 1e-9)
    assert (known == covered).all()
    assert run.distance[known].max() < 1e-9


def test_every_metric_has_a_unit_and_says_what_it_is():
    for metric in METRICS.values():
        assert metric.unit in UNITS
        assert len(metric.definition) > 12
