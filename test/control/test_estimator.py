from dataclasses import dataclass, replace

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import Link, sampled, simulate
from climber_uk.control.approach import ANYWHERE, Approach
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.exact import Exact
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import DisturbanceEstimate, Observer
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.time_scaling import Pacing
from climber_uk.control.timing import Timing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State, Torques
from climber_uk.mechanics.shapes import Circle, Ellipse, Lemniscate, Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.declaration import parameter
from climber_uk.simulation.sensors import Sensors

pytestmark = pytest.mark.slow

PAPER = Trajectory(Ellipse(), ConstantRate())
START = State(np.array([0.0, 6.0, 0.0]), np.array([10.0, 0.0, -0.6]))
RAMPED = Trajectory(Ellipse(), RestToRest(rate=1.0, ramp_time=3.0, laps=9))
CLIMBER = Climber()
BUILT = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
BUILT_GAINS = Guidance(cross_track_gain=3.0, fade_speed=0.1)
FIXED_MODEL = Observer(bandwidth=0.0)
GUIDANCE_STIFFNESS = Guidance().frequency ** 2
GUIDANCE, LAW, OBSERVER, TIMING, PACING = (
    Guidance(),
    ControlOptions(),
    Observer(),
    Timing(),
    Pacing(),
)
SAFETY, IDEAL = Safety(), Link()


def controller(
    climber=CLIMBER,
    constraints=GUIDANCE,
    options=LAW,
    observer=OBSERVER,
    timing=TIMING,
    pacing=PACING,
    safety=SAFETY,
    **parts,
):
    law = ControlLaw(climber, constraints, options)
    return Controller(Settings(law, observer, timing, pacing), safety, **parts)


def lap(controlling, climber=CLIMBER, link=IDEAL, duration=5.0):
    return simulate(PAPER, START, duration, controlling, climber, link)


@pytest.mark.parametrize("constraints", [Guidance(), Exact()], ids=["guidance", "exact"])
def test_the_papers_ellipse_is_tracked_to_hundredths_of_a_millimetre(constraints):
    run = lap(controller(constraints=constraints))
    assert run.rms() <= 0.02e-3
    assert run.distance.max() <= 0.05e-3


@pytest.mark.parametrize(
    ("delay", "times"), [(0.0, 47), pytest.param(0.005, 50, marks=pytest.mark.soak)]
)
def test_prediction_takes_the_error_of_holding_a_torque_away(delay, times):
    def error(options=LAW, known=True):
        timing = Timing(transport_delay=delay * known)
        ours = controller(options=options, timing=timing, observer=FIXED_MODEL)
        return lap(ours, link=Link(delay=delay), duration=7.0).rms(after=1.0)

    other = error(known=False) if delay else error(ControlOptions(predict=False))
    assert error() < other / times


def test_the_delay_that_the_clock_shows_need_not_be_known():
    late = Link(jitter=0.02)
    measured = lap(controller(observer=FIXED_MODEL), link=late).rms(after=2.0)
    ignored = lap(controller(observer=FIXED_MODEL, timing=Timing(measure_delay=False)), link=late)
    assert measured < ignored.rms(after=2.0) / 3


@pytest.mark.parametrize("share", [pytest.param(0.5, marks=pytest.mark.soak), 1.5])
def test_friction_that_is_not_known_is_learnt(share):
    other = replace(CLIMBER, seal_friction_coefficient=0.8 * share)
    ours = controller()
    assert lap(ours, other).rms(after=2.0) < 0.02e-3
    more = other.seal_friction - CLIMBER.seal_friction
    assert ours.estimator.disturbance[0] == pytest.approx(-more, abs=0.1)
    off = (
        abs(more) / CLIMBER.mass / GUIDANCE_STIFFNESS
    )  # what holds against a force that is not known
    unlearnt = lap(controller(observer=FIXED_MODEL), other).rms(after=2.0)
    assert unlearnt == pytest.approx(off, rel=0.1)


@pytest.mark.parametrize("pressure", [2000.0, np.array([2000.0, 7000.0])])
def test_friction_that_was_learnt_is_none_beyond_that_of_a_seal_with_less_suction(pressure):
    controlling, lost = controller(BUILT), replace(BUILT, suction_pressure=pressure)
    estimator = controlling.estimator
    estimator.learnt = DisturbanceEstimate(force=3.0, friction=-16.0)
    controlling.law = replace(controlling.law, climber=lost)
    assert estimator.climber is lost
    assert estimator.learnt.force == 3.0
    f = lost.seal_friction  # 14.4, or more than was learnt
    np.testing.assert_array_equal(estimator.learnt.friction, np.maximum(-16.0, -f))


def test_an_estimator_goes_on_from_the_memory_of_another():
    first, second = (controller().estimator for _ in range(2))
    motion, period = START.motion, SECOND // 200
    for tick in range(4):
        first.see(SECOND + tick * period, motion)
        first.sent(first.ahead(0.002).begins, Torques(0.1 * tick, 0.2), True, 10.0)
    second.remember(*first.memory, stamp=5 * SECOND)
    assert second.memory == first.memory
    first.see(first.stamp + period, motion)
    second.see(5 * SECOND + period, motion)
    assert second.memory == first.memory


def test_mass_and_inertia_may_be_off_by_a_fifth():
    other = replace(CLIMBER, mass=6.0, yaw_inertia=1.2 * 0.33)
    assert lap(controller(), other).rms() < 1e-3


def test_odometry_may_be_noisy():
    noise = Link(
        sensors=Sensors(
            position_noise=1e-3, heading_noise=1e-3, speed_noise=1e-2, yaw_rate_noise=1e-2
        )
    )
    assert lap(controller(), link=noise).rms() < 1e-3


def test_odometry_may_be_lost_and_late():
    ours = controller()
    run = lap(ours, link=Link(loss=0.3, jitter=0.02))
    assert run.rms() < 2e-3
    assert ours.mode is Mode.FOLLOWING


@pytest.mark.parametrize(
    "period",
    [pytest.param(0.001, marks=pytest.mark.soak, id="1000 Hz"), pytest.param(0.05, id="20 Hz")],
)
def test_odometry_may_come_at_other_rates(period):
    eight = Trajectory(Lemniscate(1.5, 0.75), RestToRest(rate=0.12), origin=(0.0, 3.0))
    start = State(np.array([0.0, 3.0, np.pi / 4]), np.zeros(3))
    ours = controller(BUILT, BUILT_GAINS)
    run = simulate(eight, start, 2.5, ours, BUILT, Link(step=0.001, period=period))
    assert run.rms() < 1e-3
    assert ours.estimator.period == pytest.approx(period, rel=1e-6)


@pytest.mark.parametrize("noise", [pytest.param(0.0, marks=pytest.mark.soak), 1e-3])
def test_odometry_may_lack_the_twist(noise):
    link = Link(with_twist=False, sensors=Sensors(position_noise=noise, heading_noise=noise))
    ours = controller(observer=Observer(velocity_source="pose"))
    start = State(RAMPED.at(0.0).pose, np.zeros(3))
    run = simulate(RAMPED, start, 6.0, ours, CLIMBER, link)
    assert run.rms(after=2.0) < 1e-3
    assert ours.mode is Mode.FOLLOWING


def test_a_missing_twist_is_noticed():
    ours = controller()
    start = State(RAMPED.at(0.0).pose, np.zeros(3))
    simulate(RAMPED, start, 3.0, ours, CLIMBER, Link(with_twist=False))
    assert ours.mode is Mode.NO_TWIST
    assert ours.detail == "linear.x; set velocity_source to pose"


@pytest.mark.parametrize(
    "seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 8))]
)
def test_guidance_comes_back_from_far_off_without_spinning(seed):
    random = np.random.default_rng(seed)
    weak = replace(CLIMBER, max_wheel_torque=4.0)
    offset = np.array([*random.uniform(-0.5, 0.5, 2), random.uniform(-1, 1)])
    start = State(RAMPED.at(0.0).pose + offset, np.zeros(3))
    run = simulate(RAMPED, start, 4.0, controller(weak), weak)
    assert run.distance[run.time >= 3.0].max() < 0.01
    assert np.abs(run.error[:, 2]).max() < np.pi / 2
    assert np.abs(run.torques).max() <= 4.0


@pytest.mark.soak
@pytest.mark.parametrize("time", [6.0, 14.0, 34.0, 42.0])
def test_a_slow_climber_comes_to_a_new_path_from_anywhere_on_the_old_one(time):
    """Behind, ahead, beside, turned the other way: it once drove off backwards for ever."""
    eight = Trajectory(Lemniscate(1.5, 0.75), RestToRest(rate=0.12), origin=(0.0, 3.0))
    circle = Trajectory(Circle(0.5), RestToRest(rate=0.4, ramp_time=1.0), origin=(-0.5, 3.0))
    start = State(eight.at(time).pose, np.zeros(3))
    ours = controller(BUILT, BUILT_GAINS, approach=Approach(max_distance=0.1, approach_speed=0.3))
    run = simulate(circle, start, 24.0, ours, BUILT)
    off_the_circle = np.hypot(run.pose[:, 0] + 0.5, run.pose[:, 1] - 3.0) - 0.5
    assert np.abs(off_the_circle[run.time > 22.0]).max() < 2e-3
    assert ours.mode is Mode.FOLLOWING
    assert np.abs(run.velocity[:, :2]).max() < 0.31
    assert np.abs(run.velocity[:, 2]).max() < 1.5


def test_a_reference_that_has_left_is_approached_and_followed():
    start = State(np.array([3.0, 0.0, 2.0]), np.zeros(3))  # the reference has left at 10 m/s
    weak = replace(CLIMBER, max_wheel_torque=4.0)
    there = Approach(max_start_distance=10.0, approach_speed=2.0, approach_yaw_rate=2.0)
    ours = controller(weak, approach=there)
    run = simulate(PAPER, start, 14.0, ours, weak)
    assert ours.mode is Mode.FOLLOWING
    assert off_the_ellipse(run)[run.time > 11.0].max() < 1e-3
    assert np.abs(run.torques).max() <= 4.0
    assert np.abs(run.velocity[:, 2]).max() < 10.0  # no spin


@pytest.mark.parametrize(
    ("share", "most"), [pytest.param(1.0, 1.5e-3, marks=pytest.mark.soak), (1.3, 10e-3)]
)
def test_it_stops_where_it_shall_and_reverses_there(share, most):
    """One run along a line, a pause, and back with the heading kept: in reverse gear."""
    line = Trajectory(Line(1.0, 0.5), RestToRest(rate=0.2, ramp_time=1.0, runs=2, pause=2.0))
    true = replace(BUILT, seal_friction_coefficient=0.6 * share)
    start = State(line.at(0.0).pose, np.zeros(3))
    ours = controller(BUILT, BUILT_GAINS)
    ours.guard.budget.is_new = False  # else it would begin later: friction holds at first
    run = simulate(line, start, 16.0, ours, true)
    for rests in (run.time > 6.75) & (run.time < 7.9), run.time > 14.75:
        assert run.distance[rests].max() < 0.05e-3
        assert np.abs(run.velocity[rests]).max() < 0.1e-3  # it creeps home
    assert ours.active.waited < 0.3  # while friction is learnt
    assert np.abs(run.error[:, 1]).max() < most
    assert np.abs(run.error[:, 2]).max() < 1e-2


def too_weak(controlling, weak, until, duration=15.0):
    """The paper's ellipse with weaker motors from 5 s on, as the controller knows."""

    def climber(time):
        now = weak if 5.0 <= time < until else CLIMBER
        if controlling.law.climber is not now:
            controlling.law = replace(controlling.law, climber=now)
        return now

    return simulate(PAPER, START, duration, controlling, climber)


def off_the_ellipse(run):
    """Distance from the ellipse as a curve, not from where the reference is by then."""
    x, y = run.pose[:, 0], run.pose[:, 1]
    value = np.hypot(x / 10, y / 6) - 1
    slope = np.hypot(x / 100, y / 36) / np.hypot(x / 10, y / 6)
    return np.abs(value / slope)


def test_with_too_little_torque_it_stays_on_the_path_and_lags_along_it():
    weak = replace(CLIMBER, max_wheel_torque=0.7 * 1.5583)
    run = too_weak(controller(), weak, until=7.0, duration=14.0)
    assert off_the_ellipse(run).max() < 0.05
    assert run.error[:, 0].min() < -3.0  # it really was too weak
    after = run.time > 7.5
    assert run.error[after, 0].max() < 0.1
    assert run.distance[-1] < 1e-2
    alone = controller(pacing=Pacing(catch_up=0.0), approach=ANYWHERE, guard=UNGUARDED)
    unpaced = too_weak(alone, weak, 7.0, 8.0)
    assert off_the_ellipse(unpaced).max() > 0.5  # what pacing is for


def test_stalled_it_waits_on_the_path_without_chatter():
    ours = controller(guard=UNGUARDED)
    run = too_weak(ours, replace(CLIMBER, max_wheel_torque=0.3), 99.0, 9.0)
    last = run.time > 8.0
    assert np.abs(np.diff(run.torques[last], axis=0)).max() < 1e-3
    assert off_the_ellipse(run).max() < 0.05


def test_gains_change_without_a_jump_of_the_torque():
    before, after = Guidance(), Guidance(frequency=24.0, damping=0.8)

    def steps(change):
        ours = controller(constraints=before)
        ours.on_reference(SECOND, sampled(PAPER, 1.0))
        offset = State(START.pose + np.array([-0.05, 0.05, 0.1]), START.velocity)
        old = ours.on_odometry(SECOND, SECOND, offset.motion).torques
        change(ours)
        stamp = SECOND + 5_000_000
        expected = ours.estimator.expected_at(stamp)
        return np.abs(ours.on_odometry(stamp, stamp, expected).torques - old).max()

    def replace_at_once(ours):
        ours.law = replace(ours.law, constraints=after)

    def retune_to_them(ours):
        retune(ours, after)

    assert steps(retune_to_them) < steps(lambda _: None) + 0.01 * steps(replace_at_once)


def retune(ours, constraints):
    estimator = ours.estimator
    law = replace(ours.law, constraints=constraints)
    ours.retune(Settings(law, estimator.observer, estimator.timing, ours.active.pacing))


def test_changed_gains_act_in_full_half_a_second_later():
    ours, after = controller(), Guidance(frequency=24.0)
    ours.estimator.see(SECOND, START.motion)
    retune(ours, after)
    assert ours.constraints.frequency == 18.0
    ours.estimator.stamp += SECOND // 4
    assert ours.constraints.frequency == pytest.approx(21.0)
    ours.estimator.stamp += SECOND // 4
    assert ours.constraints is after


@dataclass(frozen=True)
class Named(Guidance):
    """As a constraint set of another package, with more than gains."""

    kind: str = parameter("slow", "", "what it is", runtime=True)


def test_what_is_no_gain_changes_at_once():
    ours = controller(constraints=Named())
    ours.estimator.see(SECOND, START.motion)
    retune(ours, Named(frequency=24.0, kind="fast"))
    ours.estimator.stamp += SECOND // 4
    assert ours.constraints == Named(frequency=21.0, kind="fast")


def test_a_torque_limit_does_not_wind_the_observer_up():
    weak = replace(CLIMBER, max_wheel_torque=0.9)
    ours = controller(weak)
    lap(ours, replace(weak, seal_friction_coefficient=1.0), duration=3.0)
    more = 0.2 * 0.47 * 150
    assert abs(ours.estimator.disturbance[0]) < 2 * more


def test_times_without_sense_are_refused():
    with pytest.raises(ValueError, match=r"control_period=0.0 must be > 0 \[s\]"):
        Timing(control_period=0.0)
    with pytest.raises(ValueError, match=r"transport_delay=-1.0 must be >= 0 \[s\]"):
        Timing(transport_delay=-1.0)
