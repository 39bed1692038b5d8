import math

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.guidance import Guidance
from climber_uk.control.safety import SPEED_TIME, Mode, Safety
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

HERE = State.rolling(np.array([1.0, 2.0, 0.3]), 0.5, 0.2).motion
HALF_TRACK = 0.5  # [m]
CIRCLE = Trajectory(Circle(), ConstantRate(rate=0.5))
MILLISECOND = SECOND // 1000


def elsewhere(x=0.0, y=0.0, heading=0.0, speed=0.0, yaw_rate=0.0):
    """The motion expected, moved by so much."""
    pose = np.array([HERE.x + x, HERE.y + y, HERE.heading + heading])
    return State.rolling(pose, HERE.speed + speed, HERE.yaw_rate + yaw_rate).motion


@pytest.mark.parametrize(
    ("name", "limit"),
    [
        ("x", 0.2),
        ("y", 0.2),
        ("heading", 0.2 / HALF_TRACK),
        ("speed", 0.2 / 0.1),
        ("yaw_rate", 0.2 / (HALF_TRACK * 0.1)),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_wheel_has_jumped_if_it_is_or_will_soon_be_too_far_from_where_it_should_be(
    name, limit, sign
):
    safety = Safety(max_jump=0.2)
    assert SPEED_TIME == 0.1
    assert not safety.has_jumped(HERE, elsewhere(**{name: sign * 0.95 * limit}), HALF_TRACK)
    assert safety.has_jumped(HERE, elsewhere(**{name: sign * 1.05 * limit}), HALF_TRACK)


def test_a_heading_a_turn_away_is_none_and_what_is_not_finite_has_jumped():
    assert not Safety().has_jumped(HERE, elsewhere(heading=2 * math.pi), HALF_TRACK)
    assert Safety().has_jumped(HERE, elsewhere(x=math.nan), HALF_TRACK)
    assert Safety().has_jumped(HERE, elsewhere(speed=math.inf), HALF_TRACK)


def controller(now=SECOND, **safety):
    """A controller that has answered an odometry of 1 s on its path, and the climber's state."""
    controller = Controller(Settings(ControlLaw(Climber(), Guidance())), Safety(**safety))
    controller.on_reference(now, sampled(CIRCLE, 10.0))
    start = CIRCLE.at(0.0)
    state = State(start.pose, start.velocity)
    controller.on_odometry(now, SECOND, state.motion)
    assert controller.mode is Mode.FOLLOWING
    return controller, state


@pytest.mark.parametrize(
    ("fault", "mode"),
    [
        (lambda f: f.on_bad_odometry(SECOND, "nan"), Mode.BAD_ODOMETRY),
        (lambda f: f.look(SECOND + SECOND // 5), Mode.NO_ODOMETRY),
        (lambda f: [f.look(0) for _ in range(30)], Mode.NO_CLOCK),
    ],
)
def test_a_fault_forgets_what_was_learnt_of_disturbances(fault, mode):
    following, state = controller()
    faster = State(state.pose, 1.02 * state.velocity)
    following.on_odometry(SECOND, SECOND + 5 * MILLISECOND, faster.motion)
    assert any(following.estimator.disturbance[:2])
    fault(following)
    assert following.mode is mode
    assert not any(following.estimator.disturbance)


@pytest.mark.parametrize(("older", "is_ignored"), [(1, True), (99, True), (101, False)])
def test_odometry_is_overtaken_within_its_timeout_and_beyond_it_time_has_started_anew(
    older, is_ignored
):
    """Without a clock, by which it would be refused."""
    following, state = controller(now=0, odometry_timeout=0.1)
    moved = State(state.pose + 0.01, state.velocity)
    following.on_odometry(0, SECOND - older * MILLISECOND, moved.motion)
    assert (following.motion.x == state.pose[0]) == is_ignored
