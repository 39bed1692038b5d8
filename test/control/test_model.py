from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from climber_uk.control.estimator import Estimator
from climber_uk.control.model import SLOW, DisturbanceEstimate, Observer, predict
from climber_uk.control.timing import Timing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.quantities import Motion, State, Torques, Wrench
from climber_uk.simulation.plant import Plant

CLIMBER = Climber()
FLOOR = {"inclination": 0.0}
STILL, NONE, NOTHING = Torques(0.0, 0.0), Wrench(0.0, 0.0), DisturbanceEstimate()


def after(climber, motion, wheels, disturbance, time):
    drive, turn = climber.wrench(*wheels)
    return predict(climber, motion, drive + disturbance.force, turn + disturbance.moment, time)


@given(
    st.floats(-3, 3),
    st.floats(2, 10),  # so fast that it does not come to rest
    st.floats(-3, 3),
    st.tuples(st.floats(-3, 3), st.floats(-3, 3)).map(lambda pair: Torques(*pair)),
)
def test_the_model_rolls_as_the_plant_does(heading, v, omega, torques):
    state = State.rolling(np.array([1.0, 2.0, heading]), v, omega)
    h = 0.005
    expected = Plant(CLIMBER, h / 10).advance(state, np.array(torques), steps=10)
    got = State.moving(after(CLIMBER, state.motion, torques, NONE, h))
    # third order in h: a rate of change of acceleration below 4000 m/s³
    np.testing.assert_allclose(got.pose, expected.pose, atol=4e3 * h**3 / 6)
    np.testing.assert_allclose(got.velocity, expected.velocity, atol=4e3 * h**3)


def test_heading_and_weight_are_those_of_the_middle():
    """By hand: without friction, in 0.1 s at 2 rad/s, which grow by 2 rad/s²."""
    slippery = replace(CLIMBER, seal_friction_coefficient=0.0)
    start = State.rolling(np.zeros(3), 1.0, 2.0).motion
    end = predict(slippery, start, 0.0, 2.0 * slippery.yaw_inertia, 0.1)
    middle = 2.0 * 0.05 + 2.0 * 0.05**2 / 2
    speed = 1.0 - GRAVITY * 0.1 * np.sin(middle)
    way = 0.1 * (1.0 + speed) / 2
    assert end.speed == pytest.approx(speed)
    assert (end.x, end.y) == pytest.approx((way * np.cos(middle), way * np.sin(middle)))
    assert (end.heading, end.yaw_rate) == pytest.approx((0.21, 2.2))


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_friction_beyond_the_models_brakes_as_well(speed):
    climber = Climber(**FLOOR)
    start = State.rolling(np.zeros(3), speed, 0.0).motion
    end = predict(climber, start, 0.0, 0.0, 0.05, friction=10.0)
    braking = (climber.seal_friction + 10.0) / climber.mass * 0.05
    assert end.speed == pytest.approx(np.sign(speed) * (1.0 - braking))


@pytest.mark.parametrize(
    ("direction", "speed", "share"),
    [
        *((1, 0.3, 0.5), (-1, -0.3, 0.5), (1, 0.0, 0.5), (1, -0.9 * SLOW, 0.5)),
        *((1, -1.1 * SLOW, 0.0), (-1, 1.1 * SLOW, 0.0), (0, 0.3, 0.0)),
    ],
)
def test_half_of_a_change_is_friction_unless_it_slides_the_other_way(direction, speed, share):
    force, friction = DisturbanceEstimate(5.0, friction=2.0).changed(CLIMBER, 8.0, direction, speed)
    assert friction == pytest.approx(2.0 - share * direction * 8.0)
    assert force - direction * friction == pytest.approx(5.0 + 8.0 - direction * 2.0)


def test_at_rest_friction_holds_what_it_can_and_no_more():
    rest = State(np.array([0.0, 0.0, np.pi / 2]), np.zeros(3)).motion
    assert after(CLIMBER, rest, STILL, NONE, 0.1).speed == 0
    more = CLIMBER.torques(CLIMBER.weight_along_wall + CLIMBER.seal_friction + 1.0, 0.0)
    assert after(CLIMBER, rest, more, NONE, 0.1).speed == pytest.approx(0.02)


def learn(observer, true, believed, state, wheels, learnt=NOTHING, steps=200, h=0.005):
    """Estimate after some steps of a climber that is not the one believed in."""
    plant = Plant(true, h / 2)
    seen = state.motion
    for _ in range(steps):
        expected = after(believed, seen, wheels, learnt, h)
        state = plant.advance(state, np.array(wheels), steps=2)
        shares = observer.shares(h, delay=0.0)
        seen, learnt = observer.corrected(believed, learnt, expected, state.motion, h, shares)
    return state, seen, learnt


SLIPPERY = Climber(seal_friction_coefficient=0.4, **FLOOR)


def test_the_observer_finds_the_friction_that_was_not_expected():
    believed = Climber(seal_friction_coefficient=0.8, **FLOOR)
    rolling = State.rolling(np.zeros(3), 1.0, 0.0)
    _, _, found = learn(Observer(), SLIPPERY, believed, rolling, believed.torques(30.0, 0.0))
    less = believed.seal_friction - SLIPPERY.seal_friction
    np.testing.assert_allclose(found[:2], [less, 0.0], atol=1e-3)


def test_without_a_twist_it_finds_friction_and_speeds_from_poses():
    believed = Climber(seal_friction_coefficient=0.8, **FLOOR)
    observer = Observer(velocity_source="pose")
    wheels = believed.torques(30.0, 0.1)
    start = State(np.zeros(3), np.zeros(3))
    state, seen, found = learn(observer, SLIPPERY, believed, start, wheels, steps=300)
    less = believed.seal_friction - SLIPPERY.seal_friction
    assert found[0] == pytest.approx(less, abs=0.1)
    assert seen.speed == pytest.approx(state.forward_speed, abs=2e-3)
    assert seen.yaw_rate == pytest.approx(state.yaw_rate, abs=2e-3)


@pytest.mark.parametrize(
    ("period", "delay", "poles"),
    [
        (0.005, 0.0, 14.0),
        (0.005, 0.02, 0.4 / 0.03),  # K (2 T + δ) is 0.4 at most
        (0.05, 0.0, 4.0),
    ],
)
def test_an_observer_of_slow_or_late_odometry_is_slower(period, delay, poles):
    new = 1.0 - np.exp(-poles * period)
    assert Observer().shares(period, delay) == pytest.approx((2 * new, new**2))


def test_errors_of_the_observer_decay_with_both_poles_at_one_place_though_the_force_grows():
    """With z = exp(-K T): (1 - z B)² e = 0, where B takes the error of a period before.

    Learnt is the force of the next period.
    """
    h, rubs_nothing, observer = 0.005, Climber(seal_friction_coefficient=0.0, **FLOOR), Observer()
    seen, learnt = State.rolling(np.zeros(3), 1.0, 0.3).motion, NOTHING
    errors, true = [], Wrench(8.0, 1.0)
    for _ in range(40):
        expected = after(rubs_nothing, seen, STILL, learnt, h)
        measured = after(rubs_nothing, seen, STILL, true, h)
        shares = observer.shares(h, delay=0.0)
        seen, learnt = observer.corrected(rubs_nothing, learnt, expected, measured, h, shares)
        true = Wrench(true.force + 20.0 * h, true.moment - 3.0 * h)
        errors.append((learnt.force - true.force, learnt.moment - true.moment))
    decays = np.poly([np.exp(-14.0 * h)] * 2)
    for of_one in np.array(errors).T:
        np.testing.assert_allclose(np.convolve(of_one, decays, mode="valid"), 0, atol=1e-9)
        assert abs(of_one[0]) > 0.5


@pytest.mark.parametrize(("speed", "rate"), [(0.9e-3, 0.0), (1.1e-3, 6.0), (-1.1e-3, 6.0)])
def test_a_force_that_grew_is_not_expected_to_at_rest(speed, rate):
    expected = State.rolling(np.zeros(3), speed, 0.0).motion
    learnt = DisturbanceEstimate(force_rate=6.0, moment_rate=2.0)
    _, found = Observer().corrected(CLIMBER, learnt, expected, expected, 0.005, (0.1, 0.01))
    assert (found.force_rate, found.moment_rate) == (rate, 2.0)


@pytest.mark.parametrize(
    ("to_be", "speed", "force"), [(0.0, 0.9e-3, 0.0), (0.0, 1.1e-3, 0.11), (1.1e-3, 0.9e-3, -0.02)]
)
def test_what_creeps_where_it_is_to_rest_is_no_force(to_be, speed, force):
    expected = State.rolling(np.zeros(3), to_be, 0.0).motion
    found = expected._replace(speed=speed)
    _, learnt = Observer().corrected(CLIMBER, NOTHING, expected, found, 0.005, (0.1, 0.01))
    assert learnt.force == pytest.approx(force)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("speed", "settling", "unexpected", "share_of"),
    [
        (0.2, 0.15, 30.0, 30.0),
        (0.2, 0.15, 90.0, 40.0),  # no more than was learnt there
        (0.2, 0.15, -30.0, 0.0),  # friction is no less
        (0.04, 0.15, 30.0, 0.0),  # it has not broken loose
        (0.2, 0.0, 30.0, 0.0),  # long ago
    ],
)
def test_what_only_held_at_rest_is_unlearnt_as_soon_as_it_breaks_loose(
    way, speed, settling, unexpected, share_of
):
    stuck = -40.0 if settling else 0.0
    learnt = DisturbanceEstimate(-20.0 * way, friction=20.0, settling=settling, stuck=stuck * way)
    expected = State.rolling(np.zeros(3), way * (speed - 0.005 * unexpected / 5), 0.0).motion
    found = expected._replace(speed=way * speed)
    _, then = Observer().corrected(CLIMBER, learnt, expected, found, 0.005, (0.0, 1.0), way)
    before, after = (it.force - way * it.friction for it in (learnt, then))
    unlearnt = way * share_of * (1 - np.exp(-0.25))
    assert after - before == pytest.approx(unlearnt, abs=1e-9)
    assert then.stuck == pytest.approx(stuck * way + unlearnt)
    assert (then.force_rate == 0.0) == (settling > 0)


def test_what_is_learnt_at_rest_is_remembered_until_it_has_slid_for_a_while():
    def seen(estimator, tick, speed):
        estimator.see(SECOND + tick * SECOND // 200, State.rolling(np.zeros(3), speed, 0.0).motion)
        return estimator.learnt

    estimator = Estimator(CLIMBER, Observer(), Timing())
    for tick in range(10):
        learnt = seen(estimator, tick, 0.0)
        estimator.sent(estimator.begin(0.0), Torques(3.0, 3.0), True, 0.2)
    assert learnt.stuck == pytest.approx(learnt.force - learnt.friction)
    assert learnt.stuck < -10.0
    for tick in range(10, 49):
        assert seen(estimator, tick, 0.011).stuck < 0.0
    for tick in range(49, 52):
        learnt = seen(estimator, tick, 0.011)
    assert learnt.stuck == 0.0


def test_what_is_as_expected_changes_nothing_that_was_learnt():
    rolling = State.rolling(np.zeros(3), 1.0, 0.0).motion
    learnt = DisturbanceEstimate(9.0, 1.0, 0.0, 0.0, 3.0)
    for source in ("odometry", "pose"):
        observer = Observer(velocity_source=source)
        _, found = observer.corrected(CLIMBER, learnt, rolling, rolling, 0.005, (0.1, 0.01), 1.0)
        assert found == learnt
    assert learnt._replace(force_rate=7.0, moment_rate=2.0).without_rates == learnt


@pytest.mark.parametrize("source", ["odometry", "pose"])
def test_an_observer_that_is_off_forgets_in_a_fifth_of_a_second(source):
    observer = Observer(bandwidth=0.0, velocity_source=source)
    rolling = State.rolling(np.zeros(3), 1.0, 0.0).motion
    learnt = DisturbanceEstimate(9.0, 1.0, friction=3.0)
    _, found = observer.corrected(CLIMBER, learnt, rolling, rolling, 0.2, (0.0, 0.0))
    left = np.exp(-1)
    forgotten = DisturbanceEstimate(9.0 * left, left, friction=3.0 * left)
    assert found == pytest.approx(forgotten)


def test_what_friction_holds_teaches_nothing():
    believed = Climber(seal_friction_coefficient=1.2)
    start = State(np.array([0.0, 0.0, np.pi / 2]), np.zeros(3))
    _, _, found = learn(Observer(), CLIMBER, believed, start, STILL)
    np.testing.assert_array_equal(found, 0)


@pytest.mark.parametrize("source", ["odometry", "pose"])
def test_switched_off_it_forgets(source):
    observer = Observer(bandwidth=0.0, velocity_source=source)
    rolling = State.rolling(np.zeros(3), 1.0, 0.0)
    _, _, found = learn(
        observer, SLIPPERY, SLIPPERY, rolling, STILL, DisturbanceEstimate(9.0, 1.0), 400
    )
    np.testing.assert_allclose(found, 0, atol=1e-3)


@example(0.0, 5e-324, 0.0, 0.005)
@given(
    st.floats(-3, 3),
    st.floats(-0.3, 0.3),
    st.floats(-120, 120),
    st.sampled_from([0.005, 0.02, 0.05]),
)
def test_friction_ends_a_motion_and_does_not_reverse_it(heading, v, drive, time):
    """As the plant finds it in fifty steps."""
    start = State.rolling(np.array([0.0, 0.0, heading]), v, 0.0)
    wheels = np.array(CLIMBER.torques(drive, 0.0))
    expected = Plant(CLIMBER, time / 50).advance(start, wheels, 50)
    got = predict(CLIMBER, start.motion, drive, 0.0, time)
    # up to `SLOW` it may as well be at rest
    atol = 1e-6 if abs(v) > SLOW else 1.001 * SLOW
    assert got.speed == pytest.approx(expected.forward_speed, abs=atol)
    assert np.hypot(got.x - expected.pose[0], got.y - expected.pose[1]) < atol * time + 1e-7


def test_many_that_stop_roll_as_each_of_them_does():
    speeds, drives = np.array([0.02, -0.02, 0.02, 0.3, 0.005]), np.array([0, 0, -90, 30, 0.0])
    states = State.rolling(np.zeros((5, 3)), speeds, np.zeros(5))
    many = predict(CLIMBER, states.motion, drives, np.zeros(5), 0.01)
    for i, (speed, drive) in enumerate(zip(speeds, drives, strict=True)):
        one = predict(CLIMBER, State.rolling(np.zeros(3), speed, 0.0).motion, drive, 0.0, 0.01)
        assert (many.speed[i], many.x[i]) == pytest.approx((one.speed, one.x), abs=1e-15)


@pytest.mark.parametrize("bandwidth", [14.0, 0.0], ids=["learning", "off"])
@pytest.mark.parametrize("part", ["speed", "yaw_rate"])
def test_errors_of_the_pose_filter_decay_with_its_two_poles_and_that_of_the_disturbance(
    bandwidth, part
):
    """With z = exp(-p T) of each: Π (1 - z B) e = 0, where B takes the error of a period before."""
    h, rubs_nothing = 0.005, Climber(seal_friction_coefficient=0.0, **FLOOR)
    observer = Observer(bandwidth=bandwidth, velocity_source="pose")
    turns = part == "yaw_rate"
    true = State.rolling(np.zeros(3), 0.0 if turns else 1.0, 0.3 if turns else 0.0).motion
    seen, learnt = true._replace(**{part: 0.9 * getattr(true, part)}), DisturbanceEstimate()
    errors = []
    for _ in range(20):
        expected = after(rubs_nothing, seen, STILL, learnt, h)
        true = after(rubs_nothing, true, STILL, NONE, h)
        shares = observer.shares(h, delay=0.0)
        seen, learnt = observer.corrected(rubs_nothing, learnt, expected, true, h, shares)
        errors.append(getattr(seen, part) - getattr(true, part))
    poles = [observer.pose_bandwidth] * 2 + [bandwidth / 2] * (bandwidth > 0)
    decays = np.poly(np.exp(-h * np.array(poles)))
    np.testing.assert_allclose(np.convolve(errors, decays, mode="valid"), 0, atol=1e-12)
    assert abs(errors[0]) > 0.01


def test_of_many_that_take_speeds_from_poses_each_has_its_own_bandwidth():
    bandwidths = [0.0, 14.0]
    learnt = DisturbanceEstimate(3.0, 0.2, friction=1.0)
    expected = Motion.at(1.0, 2.0, 0.3, 0.5, 0.1)
    measured = Motion.at(1.01, 2.02, 0.31, 0.5, 0.1)

    def corrected(bandwidth, expected):
        observer = Observer(bandwidth=bandwidth, velocity_source="pose")
        shares = observer.shares(0.005, 0.0)
        return observer.corrected(Climber(), learnt, expected, measured, 0.005, shares)

    many = corrected(np.array(bandwidths), Motion(*(np.full(2, each) for each in expected)))
    for i, bandwidth in enumerate(bandwidths):
        for got, wanted in zip(many, corrected(bandwidth, expected), strict=True):
            for numbers, number in zip(got, wanted, strict=True):
                assert np.broadcast_to(numbers, 2)[i] == pytest.approx(number, rel=1e-12)


def test_friction_that_holds_at_rest_is_overcome_and_taken_back_without_a_jump():
    learnt, shares = DisturbanceEstimate(), []
    for _ in range(200):
        learnt = learnt.asked(0.01, True, 0.005)
    assert np.tanh(learnt.stiction) > 0.9999
    for _ in range(40):  # as its reference goes on
        learnt = learnt.asked(-0.01, False, 0.005)
        shares.append(np.tanh(learnt.stiction))
    assert shares[-1] == 0.0
    assert np.abs(np.diff(shares)).max() <= 20.0 * 0.005
