import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.control.model import Learnt, Observer, rolled
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.motion import Torques, Wrench, forces, torques
from climber_uk.simulation.plant import Plant

CLIMBER = Climber()
STILL, NONE, NOTHING = Torques(0.0, 0.0), Wrench(0.0, 0.0), Learnt()


def after(climber, motion, wheels, disturbance, time):
    drive, turn = forces(climber, *wheels)
    return rolled(climber, motion, drive + disturbance.drive, turn + disturbance.turn, time)


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
    more = torques(CLIMBER, CLIMBER.weight_along_wall + CLIMBER.seal_friction + 1.0, 0.0)
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
    _, _, found = learn(Observer(), SLIPPERY, believed, rolling, torques(believed, 30.0, 0.0))
    less = believed.seal_friction - SLIPPERY.seal_friction
    np.testing.assert_allclose(found[:2], [less, 0.0], atol=1e-3)


def test_without_a_twist_it_finds_friction_and_speeds_from_poses():
    believed = Climber(seal_friction_coefficient=0.8, **FLOOR)
    observer = Observer(velocity_source="pose")
    wheels = torques(believed, 30.0, 0.1)
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
    _, _, found = learn(observer, SLIPPERY, SLIPPERY, rolling, STILL, Learnt(9.0, 1.0), 400)
    np.testing.assert_allclose(found, 0, atol=1e-3)


@pytest.mark.parametrize(("bandwidth", "order"), [(14.0, 3), (0.0, 2)], ids=["learning", "off"])
@pytest.mark.parametrize("part", ["speed", "yaw_rate"])
def test_errors_of_the_pose_filter_decay_with_all_poles_at_one_place(bandwidth, order, part):
    """With memory z = exp(-ω T): (1 - z B)ⁿ e = 0, where B takes the error of a period before."""
    h, rubs_nothing = 0.005, Climber(seal_friction_coefficient=0.0, **FLOOR)
    observer = Observer(bandwidth=bandwidth, velocity_source="pose")
    turns = part == "yaw_rate"
    true = State.rolling(np.zeros(3), 0.0 if turns else 1.0, 0.3 if turns else 0.0).motion
    seen, learnt = true._replace(**{part: 0.9 * getattr(true, part)}), Learnt()
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
