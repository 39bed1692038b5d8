import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.control.model import SLOW, DisturbanceEstimate, Observer, predict
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, State, Torques, Wrench
from climber_uk.simulation.plant import Plant

CLIMBER = Climber()
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


FLOOR = {"inclination": 0.0}
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
    state, seen, found = learn(observer, SLIPPERY, believed, start, wheels)
    less = believed.seal_friction - SLIPPERY.seal_friction
    assert found[0] == pytest.approx(less, abs=0.1)
    assert seen.speed == pytest.approx(state.forward_speed, abs=2e-3)
    assert seen.yaw_rate == pytest.approx(state.yaw_rate, abs=2e-3)


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


@pytest.mark.parametrize(("bandwidth", "order"), [(14.0, 3), (0.0, 2)], ids=["learning", "off"])
@pytest.mark.parametrize("part", ["speed", "yaw_rate"])
def test_errors_of_the_pose_filter_decay_with_all_poles_at_one_place(bandwidth, order, part):
    """With memory z = exp(-ω T): (1 - z B)ⁿ e = 0, where B takes the error of a period before."""
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
    decays = np.poly([np.exp(-observer.pose_bandwidth * h)] * order)
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
