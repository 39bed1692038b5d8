from dataclasses import replace

import numpy as np
import pytest
from climbs import Climb
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import DisturbanceEstimate, Observer
from climber_uk.control.safety import Mode, Safety
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

CIRCLE = Trajectory(Circle(), ConstantRate(rate=0.5))
MILLISECOND = SECOND // 1000
PERIOD = 5 * MILLISECOND


class Loop:
    """A climber that is always where it should be, on a clock that the test turns."""

    def __init__(self, observer=None, **safety):
        law = ControlLaw(Climber(), Guidance())
        # it is moved by no torque
        guard = replace(UNGUARDED, speed_margin=0.05, yaw_rate_margin=1.0)
        self.controller = Controller(
            Settings(law, observer or Observer()), Safety(**safety), guard=guard
        )
        self.now = SECOND
        self.answer = None

    def plan(self, trajectory=CIRCLE):
        self.answer = self.controller.on_reference(self.now, sampled(trajectory, 10.0))

    def state(self, stamp):
        reference = CIRCLE.at((stamp - SECOND) / SECOND)
        return State(reference.pose, reference.velocity)

    def tell(self, stamp=None, moved=(0.0, 0.0, 0.0), times=1):
        for _ in range(times):
            self.now += PERIOD
            at = self.now if stamp is None else stamp
            state = self.state(at)
            state = State(state.pose + np.array(moved), state.velocity)
            self.answer = self.controller.on_odometry(self.now, at, state.motion)
        return self.controller.mode

    def look(self, after=PERIOD):
        self.now += after
        self.answer = self.controller.look(self.now)
        return self.controller.mode


@pytest.fixture
def loop():
    loop = Loop()
    loop.plan()
    assert loop.tell() is Mode.FOLLOWING
    return loop


def is_safe(loop):
    return loop.answer.command is None and not loop.answer.torques.any()


def test_it_follows_odometry_and_answers_with_its_stamp(loop):
    assert loop.answer.stamp == loop.now
    assert loop.answer.torques.any()
    assert loop.answer.command is not None


def test_the_same_odometry_again_gets_the_same_answer(loop):
    before = loop.answer
    assert loop.controller.on_odometry(loop.now, loop.now, loop.state(loop.now).motion) is before


def test_odometry_waits_for_a_reference_then_is_safe_then_is_answered():
    loop = Loop()
    assert loop.tell() is Mode.WAITING
    assert loop.answer is None
    assert loop.tell(times=25) is Mode.NO_REFERENCE
    assert is_safe(loop)
    loop.plan()
    assert loop.controller.mode is Mode.FOLLOWING
    assert loop.answer.stamp == loop.now


def test_a_clock_that_stands_still_waits_for_the_reference_for_ever():
    loop = Loop()
    for _ in range(100):
        assert loop.controller.on_odometry(loop.now, loop.now, loop.state(loop.now).motion) is None
    loop.plan()
    assert loop.answer.command is not None


def test_a_reference_that_ends_is_missed_after_its_timeout(loop):
    loop.controller.on_reference(loop.now, sampled(CIRCLE, -1.0))  # to 2 s
    assert loop.tell(times=180) is Mode.FOLLOWING
    assert loop.tell(times=30) is Mode.NO_REFERENCE
    assert is_safe(loop)


def test_a_reference_that_begins_later_is_no_fault(loop):
    later = sampled(CIRCLE, 10.0)
    begin = loop.now + SECOND
    shifted = type(later)(
        later.times - SECOND + begin, later.pose + 1.0, later.velocity, later.acceleration
    )
    loop.controller.on_reference(loop.now, shifted)
    assert loop.tell() is Mode.NOT_BEGUN
    assert is_safe(loop)
    assert not loop.controller.mode.is_fault


def test_odometry_that_stops_is_noticed_and_followed_when_it_is_back(loop):
    assert loop.look(50 * MILLISECOND) is Mode.FOLLOWING
    assert loop.answer is None
    assert loop.look(60 * MILLISECOND) is Mode.NO_ODOMETRY
    assert is_safe(loop)
    assert loop.tell() is Mode.NO_ODOMETRY  # it may be as old as it was silent
    assert is_safe(loop)
    assert loop.tell(times=22) is Mode.NO_ODOMETRY
    assert loop.tell() is Mode.FOLLOWING


def test_odometry_that_is_silent_is_noticed_however_patient_its_timeout(loop):
    loop.controller.safety = replace(loop.controller.safety, odometry_timeout=2.0)
    assert loop.look(290 * MILLISECOND) is Mode.FOLLOWING
    assert loop.look(20 * MILLISECOND) is Mode.NO_ODOMETRY
    assert is_safe(loop)
    assert loop.tell() is Mode.FOLLOWING


def test_odometry_that_never_comes_is_noticed():
    loop = Loop()
    assert loop.look() is Mode.WAITING
    assert loop.look(200 * MILLISECOND) is Mode.NO_ODOMETRY


@pytest.mark.parametrize("age", [-200, 200], ids=["future", "past"])
def test_a_stamp_far_from_the_clock_is_refused(loop, age):
    assert loop.tell(stamp=loop.now - age * MILLISECOND) is Mode.BAD_ODOMETRY
    assert is_safe(loop)
    assert loop.tell() is Mode.FOLLOWING


def test_an_odometry_that_was_overtaken_is_ignored(loop):
    loop.tell(times=3)
    stamp = loop.answer.stamp
    assert loop.tell(stamp=stamp - 7 * MILLISECOND) is Mode.FOLLOWING
    assert loop.answer is None
    assert loop.tell() is Mode.FOLLOWING
    assert loop.answer.stamp > stamp


def test_a_clock_that_went_back_starts_anew(loop):
    loop.tell(times=100)
    loop.now = SECOND
    assert loop.tell() is Mode.WAITING  # for a reference of the new time
    loop.plan()
    assert loop.tell() is Mode.FOLLOWING


@pytest.mark.parametrize("back", [1, 20, 150])
def test_a_clock_that_went_back_by_a_little_is_ridden_out(loop, back):
    loop.tell(times=100)
    position = loop.controller.active.position(loop.controller.stamp)
    loop.now -= back * MILLISECOND
    assert loop.tell() is Mode.FOLLOWING
    here = loop.controller.active.position(loop.controller.stamp)
    assert position <= here < position + PERIOD
    loop.tell(times=2)
    assert loop.controller.active.position(loop.controller.stamp) == here + 2 * PERIOD


@pytest.mark.parametrize("back", [1, MILLISECOND, SECOND // 10, SECOND, 3600 * SECOND])
def test_what_only_enabling_ends_is_ended_by_no_clock_that_goes_back(loop, back):
    loop.tell(times=3)
    guard = loop.controller.guard
    for _ in range(guard.options.attempts):
        guard.count(loop.controller.stamp, (Mode.TOO_FAST, "9 m/s"))
    loop.look(-back)
    assert guard.is_for_good
    loop.controller.enable(True)
    assert not guard.is_for_good
    assert not guard.faults


def test_a_clock_that_was_set_back_holds_the_climber_as_before():
    loop = Loop(safe_output="hold")
    loop.plan()
    loop.tell(times=20)
    loop.controller.enable(False)
    loop.tell()
    real = loop.state
    loop.state = lambda stamp: State(real(stamp).pose, 2 * real(stamp).velocity)
    loop.tell(times=10)
    right, left = coasting = loop.answer.torques
    assert right == left > 0  # it lets go of what it seems to push, and carries the weight
    loop.now -= 100 * MILLISECOND
    loop.tell(times=10)
    assert (loop.answer.torques < coasting).all()  # it brakes again


def test_odometry_that_stops_with_a_clock_set_back_is_noticed(loop):
    loop.now -= 3600 * SECOND
    loop.look()
    assert loop.look(200 * MILLISECOND) is Mode.NO_ODOMETRY


@pytest.mark.parametrize("ahead", [0, 50, 90])
def test_odometry_that_stops_is_noticed_as_soon_though_its_clock_is_ahead(loop, ahead):
    for _ in range(20):
        loop.now += PERIOD
        stamp = loop.now + ahead * MILLISECOND
        loop.controller.on_odometry(loop.now, stamp, loop.state(stamp).motion)
    assert loop.look(90 * MILLISECOND) is Mode.FOLLOWING
    assert loop.look(20 * MILLISECOND) is Mode.NO_ODOMETRY  # after `odometry_timeout`


def test_bad_odometry_is_safe_at_once(loop):
    answer = loop.controller.on_bad_odometry(loop.now, "nan")
    assert answer.command is None
    assert (loop.controller.mode, loop.controller.detail) == (Mode.BAD_ODOMETRY, "nan")
    assert loop.tell() is Mode.FOLLOWING


@pytest.mark.parametrize("moved", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)], ids=["place", "heading"])
def test_a_jump_is_safe_until_odometry_agrees_with_itself(loop, moved):
    modes = [loop.tell(moved=moved) for _ in range(5)]
    assert modes == 4 * [Mode.JUMPED] + [Mode.FOLLOWING]
    assert np.abs(loop.answer.torques).max() <= 20.0


def test_a_single_wrong_odometry_never_reaches_the_wheels(loop):
    assert loop.tell(moved=(1.0, 0.0, 0.0)) is Mode.JUMPED
    assert is_safe(loop)
    assert loop.tell() is Mode.JUMPED  # back again is a jump, too
    assert loop.tell(times=4) is Mode.FOLLOWING


def test_a_fault_forgets_what_was_learnt(loop):
    loop.controller.estimator.learnt = DisturbanceEstimate(5.0, 1.0)
    loop.tell(moved=(1.0, 0.0, 0.0))
    np.testing.assert_array_equal(loop.controller.estimator.disturbance, 0)


def test_a_twist_of_zero_while_the_pose_moves_is_a_fault_until_there_is_one():
    loop = Loop()
    loop.plan()
    real = loop.state
    loop.state = lambda stamp: State(real(stamp).pose, np.zeros(3))
    while loop.tell() is Mode.FOLLOWING:
        assert loop.now < 2 * SECOND
    assert loop.controller.mode is Mode.NO_TWIST
    assert loop.tell() is Mode.NO_TWIST
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING
    while loop.tell() is Mode.FOLLOWING:
        assert loop.now < 3 * SECOND
    assert loop.controller.mode is Mode.NO_TWIST
    loop.state = real
    assert loop.tell() is Mode.FOLLOWING


def test_disabled_it_is_safe_until_it_is_enabled(loop):
    loop.controller.enable(False)
    assert loop.tell() is Mode.DISABLED
    assert is_safe(loop)
    assert not loop.controller.mode.is_fault
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING


def test_without_a_clock_it_follows_for_a_moment_only(loop):
    assert loop.controller.mode is Mode.FOLLOWING
    for _ in range(30):
        answer = loop.controller.look(0)
    assert loop.controller.mode is Mode.NO_CLOCK
    assert answer.command is None


def test_a_clock_that_comes_right_after_the_first_odometry_is_in_time():
    loop = Loop()
    for _ in range(30):
        loop.controller.look(0)
    assert loop.controller.mode is Mode.NO_CLOCK
    # a safe output would be an answer, with which lock-step would go on
    assert loop.controller.on_odometry(0, loop.now, loop.state(loop.now).motion) is None


def test_hold_carries_the_weight_brakes_and_lets_the_brake_go_when_it_must_have_stopped():
    loop = Loop(safe_output="hold")
    loop.plan()
    loop.tell(times=20)
    weight = loop.controller.law.climber.weight_along_wall
    heading = loop.state(loop.now).heading
    loop.controller.enable(False)
    loop.tell()
    braking = loop.answer.torques.sum() / 0.027
    assert braking < weight * np.sin(heading) - 1.0
    loop.look(SECOND)
    held = loop.answer.torques.sum() / 0.027
    assert held == pytest.approx(weight * np.sin(heading), abs=2.0)


def test_a_new_reference_elsewhere_is_approached_within_the_limits(loop):
    loop.plan(Trajectory(Circle(), ConstantRate(rate=0.5), origin=(0.2, 0.1)))
    assert loop.tell() is Mode.APPROACHING
    assert np.abs(loop.answer.torques).max() <= 20.0


def test_a_reference_far_away_is_refused_in_words_until_one_is_near(loop):
    loop.plan(Trajectory(Circle(), ConstantRate(rate=0.5), origin=(3.0, 4.0)))
    way = loop.controller.active.way

    def braking(stamp):
        target = way.target(min(stamp, int(way.times[-1])))
        return State.rolling(np.array(target[:3]), target.speed, target.yaw_rate)

    loop.state = braking
    assert loop.tell() is Mode.APPROACHING
    assert loop.controller.detail == "comes to rest first"
    assert loop.tell(times=165) is Mode.TOO_FAR
    assert loop.controller.mode.is_fault
    assert is_safe(loop)
    assert "m, from (" in loop.controller.detail
    loop.plan()
    assert loop.tell() is Mode.FOLLOWING


def rolls(loop, speed, yaw_rate):
    """Have the climber go on from where it is, along an arc."""
    begin, pose = loop.now, loop.state(loop.now).pose

    def state(stamp):
        time = (stamp - begin) / SECOND
        turned = yaw_rate * time
        along = pose[2] + turned / 2
        way = speed * time * np.array([np.cos(along), np.sin(along)])
        return State.rolling(pose + np.array([*way, turned]), speed, yaw_rate)

    loop.state = state


def runs_away(loop):
    """It is too fast for a moment, and rests from then on where it is."""
    rolls(loop, 1.5, 0.5)
    assert loop.tell(times=3) is Mode.TOO_FAST
    assert is_safe(loop)
    rolls(loop, 0.0, 0.0)


def test_what_the_guard_found_is_over_when_the_climber_has_rested(loop):
    runs_away(loop)
    assert loop.tell(times=98) is Mode.TOO_FAST  # half a second
    rolls(loop, 0.021, 0.0)
    assert loop.tell(times=200) is Mode.TOO_FAST  # it creeps
    rolls(loop, 0.0, 0.0)
    assert loop.tell(times=98) is Mode.TOO_FAST
    assert loop.tell(times=4) is Mode.FOLLOWING


def test_after_the_third_fault_somebody_has_to_look(loop):
    for _ in range(2):
        runs_away(loop)
        assert not loop.controller.detail.endswith("~/enable to go on")
        assert loop.tell(times=120) is Mode.FOLLOWING
    runs_away(loop)
    assert loop.tell(times=1000) is Mode.TOO_FAST
    assert loop.controller.detail.endswith("~/enable to go on")
    loop.controller.enable(False)
    loop.tell()
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING
    runs_away(loop)  # and what was is forgiven
    assert loop.tell(times=120) is Mode.FOLLOWING


@pytest.mark.parametrize(("period", "mode"), [(79, Mode.FOLLOWING), (81, Mode.SELDOM)])
def test_odometry_of_a_period_near_its_timeout_comes_too_seldom(period, mode):
    loop = Loop()
    loop.plan()
    loop.tell()
    loop.now += period * MILLISECOND - PERIOD
    assert loop.tell() is mode


size = st.one_of(st.floats(-10, 10), st.floats(-1e6, 1e6))
vector = st.tuples(size, size, size).map(np.array)
event = st.one_of(
    st.tuples(st.just("odometry"), st.integers(-(10**9), 10**9), vector, vector),
    st.tuples(st.just("reference"), st.integers(-(10**9), 10**9), vector, vector),
    st.tuples(st.sampled_from(["good", "look", "bad", "enable", "disable"])),
)


@settings(deadline=None, max_examples=60)
@given(st.lists(event, min_size=1, max_size=20), st.sampled_from(["odometry", "pose"]))
def test_whatever_happens_torques_are_finite_and_within_the_limit(events, source):
    loop = Loop(Observer(velocity_source=source), safe_output="hold")
    loop.plan()
    for kind, *details in events:
        loop.now += PERIOD
        answer = None
        if kind == "odometry":
            shift, pose, velocity = details
            answer = loop.controller.on_odometry(
                loop.now, loop.now + shift // 10, State(pose, velocity).motion
            )
        elif kind == "reference":
            shift, pose, velocity = details
            preview = sampled(CIRCLE, 1.0)
            moved = type(preview)(
                preview.times + shift,
                preview.pose + pose,
                preview.velocity + velocity,
                preview.acceleration,
            )
            answer = loop.controller.on_reference(loop.now, moved)
        elif kind == "good":
            answer = loop.controller.on_odometry(loop.now, loop.now, loop.state(loop.now).motion)
        elif kind == "look":
            answer = loop.controller.look(loop.now)
        elif kind == "bad":
            answer = loop.controller.on_bad_odometry(loop.now, "bad")
        else:
            loop.controller.enable(kind == "enable")
        if answer is not None:
            assert np.abs(answer.torques).max() <= 20.0  # and not nan


def test_too_little_suction_stops_the_climber_until_it_is_back():
    loop = Loop(least_pressure=2000.0)
    loop.plan()
    whole = loop.controller.law
    assert loop.tell() is Mode.FOLLOWING
    loop.controller.law = replace(whole, climber=replace(whole.climber, suction_pressure=1999.0))
    assert loop.tell() is Mode.LOW_PRESSURE
    assert loop.controller.mode.is_fault
    assert is_safe(loop)
    loop.controller.law = whole
    assert loop.tell() is Mode.FOLLOWING


def faster(loop, factor, times=1, moved=(0.0, 0.0, 0.0)):
    """Odometry that tells `factor` times the speed; the mode after each."""
    modes = []
    for _ in range(times):
        loop.now += PERIOD
        state = loop.state(loop.now)
        told = State(state.pose + np.array(moved), factor * state.velocity)
        loop.answer = loop.controller.on_odometry(loop.now, loop.now, told.motion)
        modes.append(loop.controller.mode)
    return modes


def test_enabling_forgives_what_the_guard_found(loop):
    assert faster(loop, 3.0, 5)[-1] is Mode.TOO_FAST
    assert loop.tell(times=10) is Mode.TOO_FAST
    loop.controller.enable(True)
    assert loop.tell() is Mode.FOLLOWING


def test_a_twist_is_compared_from_a_jump_on(loop):
    assert set(faster(loop, 1.8, 100)) == {Mode.FOLLOWING}
    modes = faster(loop, 1.8, 60, moved=(-1.0, 0.0, 0.0))
    assert modes[0] is Mode.JUMPED
    assert set(modes) == {Mode.JUMPED, Mode.FOLLOWING}


def test_a_twist_is_compared_from_the_rest_after_a_fault_on(loop):
    loop.controller.guard.options = replace(loop.controller.guard.options, recovery_time=0.02)
    assert faster(loop, 1.8, 170)[-1] is Mode.TWIST_WRONG
    still = State(loop.state(loop.now).pose, np.zeros(3))
    begin = loop.now
    while loop.controller.mode is Mode.TWIST_WRONG:
        loop.now += PERIOD
        loop.answer = loop.controller.on_odometry(loop.now, loop.now, still.motion)
        assert loop.now - begin < SECOND
    moved = still.pose - loop.state(loop.now).pose
    assert Mode.TWIST_WRONG not in faster(loop, 1.8, 60, moved * [1, 1, 0])


@pytest.mark.slow
@pytest.mark.parametrize("duration", [28.0, pytest.param(57.0, marks=pytest.mark.soak)])
def test_the_lap_of_climber_yaml_has_the_margin_that_its_file_tells(duration):
    """The other half of it mirrors the first."""
    climb = Climb().run(duration)
    margins = [
        climb.plant.margins(state, torques)
        for state, torques in zip(climb.states[::4], climb.sent[::4], strict=True)
    ]
    assert np.min(margins) > 2.8
    assert climb.off_the_path() < 2e-3
    if duration == 57.0:  # it creeps home, ever more slowly, and rests
        climb.run(4.0)
        assert climb.fastest(since=climb.time - 0.5) < 1e-9
    place = climb.trajectory.at(duration).pose
    assert np.hypot(*(climb.state.pose - place)[:2]) < 5e-3
