from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from climbs import Climb
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.active_reference import ActiveReference
from climber_uk.control.approach import SHIFT, Approach
from climber_uk.control.guidance import Guidance
from climber_uk.control.safety import Mode
from climber_uk.control.time_scaling import Pace, Pacing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint, State
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory

slow = pytest.mark.slow


@cache
def _well(seconds):
    return Climb().run(seconds)


def under_way(seconds):
    """Climb that has gone well for some time [s]."""
    return deepcopy(_well(seconds))


def is_at_rest(climb):
    return abs(climb.state.forward_speed) < 1e-3


@slow
@pytest.mark.parametrize(
    "late", [*(pytest.param(late, marks=pytest.mark.soak) for late in (5.0, 30.0)), 600.0]
)
def test_a_reference_waits_at_its_begin_for_a_controller_that_is_enabled_late(late):
    climb = Climb()
    climb.controller.enable(False)
    climb.run(0.5)
    climb.time += late  # of which nothing is heard
    climb.run(1.0)  # odometry that was silent is not believed at once
    assert climb.controller.mode is Mode.DISABLED
    climb.controller.enable(True)
    begin = climb.time
    climb.run(4.0)
    assert climb.follows()
    assert climb.fastest() <= 1.3 * climb.reference_speed
    assert climb.off_the_path() < 0.02
    assert climb.position == pytest.approx(climb.time - begin, abs=0.02)


@slow
@pytest.mark.parametrize(
    "gap",
    [*(pytest.param(gap, marks=pytest.mark.soak) for gap in (0.4, 1.5)), 20.0],
    ids=["blink", "stopped", "gone"],
)
def test_a_reference_waits_while_odometry_is_gone_and_goes_on_where_it_was(gap):
    climb = under_way(6.0)
    position = climb.position
    lost = {"odometry": lambda *_: None, "motors": lambda _, torques: 0 * torques}
    climb.run(min(gap, 1.5), **lost)
    climb.time += max(gap - 2.0, 0.0)  # it stands, and nothing comes
    climb.run(max(gap - 1.5, 0.0) and 0.5, **lost)
    assert climb.controller.mode is Mode.NO_ODOMETRY
    begin = climb.time
    climb.run(4.0)
    assert climb.follows()
    assert climb.fastest(begin) <= 1.3 * climb.reference_speed
    assert climb.off_the_path() < 0.02
    assert position < climb.position < position + 4.2


@slow
def test_enabled_again_in_mid_course_it_goes_on_where_it_is():
    climb = under_way(6.0)
    climb.controller.enable(False)
    climb.run(1.5)
    assert is_at_rest(climb)
    stopped = climb.position
    assert stopped == pytest.approx(6.0, abs=0.1)
    climb.controller.enable(True)
    climb.run(3.0)
    assert climb.position == pytest.approx(stopped + 3.0, abs=0.5)
    assert climb.fastest() <= 1.3 * climb.reference_speed
    assert climb.off_the_path() < 0.005


@slow
def test_a_reference_that_is_not_held_back_is_kept_over_a_long_wait():
    """By a planner that does not listen: it tells the next second, and never again what was."""
    climb = under_way(6.0)
    whole = climb.controller.active.preview
    climb.controller.enable(False)
    climb.run(2.0)
    stopped = climb.position
    for begin in range(8, 48):
        times = slice(*np.searchsorted(whole.times, [begin * SECOND, (begin + 2) * SECOND]))
        told = (whole.times, whole.pose, whole.velocity, whole.acceleration)
        climb.time += 1.0
        now = SECOND + round(climb.time * SECOND)
        climb.controller.on_reference(now, Preview(*(values[times] for values in told)))
    climb.run(1.0)
    assert climb.position == stopped
    here = SECOND + round(stopped * SECOND)
    np.testing.assert_array_equal(
        climb.controller.active.preview.at(here).pose, whole.at(here).pose
    )
    climb.controller.enable(True)
    climb.run(3.0)
    assert climb.follows()
    assert climb.position == pytest.approx(stopped + 3.0, abs=0.5)
    assert climb.fastest() <= 1.3 * climb.reference_speed
    assert climb.off_the_path() < 0.005


@slow
def test_a_start_3_m_off_is_refused_with_the_distance():
    climb = Climb(offset=(3.0, 0.0, 0.0)).run(1.0)
    assert climb.controller.mode is Mode.TOO_FAR
    assert climb.controller.detail.startswith("3.00 m, from (3.00, 3.00) to (0.00, 3.00)")
    assert climb.fastest() < 1e-3


@pytest.mark.soak  # through the nodes: test/nodes/test_waiting.py
@pytest.mark.parametrize("turned", [0.0, 2.0, -3.0])
def test_a_start_3_m_off_that_is_allowed_goes_there_at_the_approach_speed(turned):
    climb = Climb(offset=(2.4, -1.8, turned), max_start_distance=5.0, approach_speed=0.4)
    climb.run(5.0)
    assert climb.controller.mode is Mode.APPROACHING
    for _ in range(23):
        climb.run(1.0)
        if climb.follows():
            break
    climb.run(2.0)
    approaching = [mode is Mode.APPROACHING for mode in climb.modes]
    speeds = [
        abs(state.forward_speed)
        for state, approaches in zip(climb.states, approaching, strict=True)
        if approaches
    ]
    assert max(speeds) < 0.42
    assert climb.follows()
    assert not any(mode.is_fault for mode in climb.modes)
    assert climb.off_the_path(since=climb.time - 2.0) < 0.005


@slow
@pytest.mark.parametrize(
    ("offset", "since"),
    [
        *((0.05, 6.0), (-0.09, 0.0)),
        *(
            pytest.param(offset, since, marks=pytest.mark.soak)
            for offset in (0.0, 0.01, 0.02, 0.03, -0.04, 0.05, 0.09, -0.09)
            for since in (0.0, 6.0)
        ),
    ],
)
def test_an_offset_of_the_clocks_is_no_latency(offset, since):
    climb = under_way(since).run(4.0, clock=offset)
    assert climb.follows()
    assert not any(mode.is_fault for mode in climb.modes)
    distance = [
        np.hypot(*(state.pose - climb.trajectory.at(time).pose)[:2])
        for time, state in zip(climb.times, climb.states, strict=True)
    ]
    assert max(distance) < 0.05
    assert max(np.abs(sent).max() for sent in climb.sent) < 3.9
    told = climb.controller.clock_offset
    assert told == pytest.approx(offset if abs(offset) > 0.05 else 0.0, abs=0.006)


@slow
@pytest.mark.parametrize(
    ("lie", "mode"),
    [
        (lambda _, s: State.rolling(s.pose, -s.forward_speed, s.yaw_rate), Mode.SIGN_WRONG),
        (lambda _, s: State.rolling(s.pose, s.forward_speed, -s.yaw_rate), Mode.SIGN_WRONG),
        (lambda _, s: State(s.pose, 0 * s.velocity), Mode.NO_TWIST),
    ],
    ids=["twist of another sign", "yaw rate of another sign", "no twist"],
)
def test_odometry_that_lies_is_found_out_before_it_does_harm(lie, mode):
    climb = Climb().run(5.0, odometry=lie)
    first = next(mode for mode in climb.modes if mode.is_fault)
    assert first is mode
    assert climb.off_the_path() < 0.05
    saturated = np.array([np.abs(sent).max() > 3.99 for sent in climb.sent])
    assert saturated.sum() * 0.005 < 0.5
    assert climb.fastest(4.5) < 0.1


@slow
@pytest.mark.parametrize(
    "scale",
    [
        *(0.1, 0.7, 2.5),
        *(pytest.param(s, marks=pytest.mark.soak) for s in (0.03, 0.2, 0.3, 0.4, 100.0)),
    ],
)
def test_a_twist_in_another_unit_does_not_end_in_a_runaway(scale):
    def scaled(_, state):
        return State.rolling(state.pose, scale * state.forward_speed, scale * state.yaw_rate)

    climb = Climb().run(10.0, odometry=scaled)
    assert any(mode.is_fault for mode in climb.modes) or climb.off_the_path() < 0.05
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1


@slow
def test_odometry_that_is_slower_than_its_timeout_allows_is_refused_in_words():
    def seldom(time, state):
        return state if round(time / 0.005) % 20 == 0 else None

    climb = Climb().run(1.0, odometry=seldom)
    assert climb.controller.mode is Mode.SELDOM
    assert climb.controller.detail == "every 0.10 s for a timeout of 0.1 s"
    slower = Climb(odometry_timeout=0.3).run(4.0, odometry=seldom)
    assert slower.off_the_path() < 0.05


angle = st.floats(-10.0, 10.0)
place = st.floats(-3.0, 3.0)


@settings(deadline=None)
@given(place, place, angle, place, place, angle)
def test_an_approach_goes_from_rest_to_rest_no_faster_than_it_should(x, y, heading, x_d, y_d, end):
    options = Approach(approach_speed=0.1, approach_yaw_rate=0.5)
    motion = Motion(x, y, heading, np.cos(heading), np.sin(heading), 0.0, 0.0)
    target = ReferencePoint(x_d, y_d, end, *[0.3] * 8)
    way = options.way(motion, target, SECOND)
    first, last = way.at(int(way.times[0])), way.at(int(way.times[-1]))
    assert way.times[0] == SECOND
    np.testing.assert_allclose(first.pose, (x, y, heading), atol=1e-9)
    assert np.hypot(*(last.pose[:2] - (x_d, y_d))) < 1e-9
    assert abs(wrapped(float(last.pose[2]) - end)) < 1e-9
    for reference in (first, last):
        np.testing.assert_allclose(reference.velocity, 0, atol=1e-9)
        np.testing.assert_allclose(reference.acceleration, 0, atol=1e-9)
    is_near = np.hypot(x - x_d, y - y_d) <= SHIFT  # it does not turn for that
    times = np.linspace(way.times[0], way.times[-1], 200).astype(np.int64)
    for time in times:
        reference = way.at(int(time))
        assert np.hypot(*reference.velocity[:2]) < 0.1 * (1 + 1e-6)  # times are whole nanoseconds
        assert abs(reference.velocity[2]) < 0.5 * (1 + 1e-6)
        across = reference.velocity[1] * np.cos(reference.heading)
        assert is_near or across == pytest.approx(
            reference.velocity[0] * np.sin(reference.heading), abs=1e-6
        )  # no side slip


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(1, 200), min_size=1, max_size=60), st.booleans())
def test_a_reference_that_nobody_follows_is_kept_in_part_only(steps, with_odometry):
    climb = Climb()
    climb.controller.enable(False)
    active, whole = climb.controller.active, climb.controller.active.preview
    shift = 0
    for step in steps:
        shift += step * SECOND // 20
        newer = type(whole)(
            whole.times[:40] + shift, whole.pose[:40], whole.velocity[:40], whole.acceleration[:40]
        )
        active.take(newer)
        if with_odometry:
            now = SECOND + shift
            climb.controller.on_odometry(now, now, climb.state.motion)
    assert len(active.preview.times) <= 5000


@slow
@pytest.mark.parametrize("turned", [-1.9, 0.45, pytest.param(-0.29, marks=pytest.mark.soak)])
def test_a_climber_that_has_turned_while_nobody_answered_goes_on_along_its_path(turned):
    climb = under_way(6.0)
    begin, before = climb.time, climb.position
    climb.run(0.5, odometry=lambda *_: None)
    climb.state = State(climb.state.pose + np.array([0.0, 0.0, turned]), np.zeros(3))
    for _ in range(10):
        climb.run(1.0)
        if climb.position > before + 1.0:
            break
    climb.run(0.5)
    assert climb.off_the_path(begin) < 0.02
    assert climb.fastest() <= 1.3 * climb.reference_speed
    assert climb.position > before + 1.0


PARTS = "pose", "velocity", "acceleration"
LINE = Trajectory(Line(length=2.0), RestToRest(rate=0.5, ramp_time=2.0))


class AtRest:
    """A climber at rest at a place, and its active reference along a line."""

    def __init__(self, x, y=0.0):
        self.active = ActiveReference(Pacing(), Approach(), Guidance())
        self.motion = State(np.array([x, y, 0.0]), np.zeros(3)).motion
        self.active.take(sampled(LINE, 5.0))

    def follow(self, stamp=SECOND):
        """Go on to the target of a stamp; return how."""
        target = self.active.target(self.motion, stamp, stamp)
        if target.point is not None:
            self.active.go_on(target)
        return target.mode


def test_a_pause_and_another_reference_end_a_way():
    climber = AtRest(1.0, 1.0)
    active = climber.active
    assert climber.follow() is Mode.APPROACHING
    assert active.followed is active.way
    assert active.position(2 * SECOND) == SECOND  # it waits meanwhile
    active.pause(SECOND)
    assert active.way is None
    assert active.at(SECOND) is None
    assert climber.follow() is Mode.APPROACHING
    active.pause(SECOND)
    other = sampled(Trajectory(Line(length=2.0), LINE.law, origin=(1.0, 1.0)), 5.0)
    active.take(other)
    assert active.followed is other
    assert active.at(SECOND) is None
    assert active.position(SECOND) is None
    assert climber.follow() is Mode.FOLLOWING


def test_another_reference_waits_until_what_is_followed_has_come_to_rest():
    """And it is approached from where the climber should be, not from where friction holds it."""
    climber = AtRest(0.0)
    active = climber.active
    assert climber.follow() is Mode.FOLLOWING
    for stamp in range(SECOND, 4 * SECOND, SECOND // 20):
        assert climber.follow(stamp) is Mode.FOLLOWING
    before = active.at(stamp)
    times = stamp + np.arange(0, 5 * SECOND, SECOND // 20)
    line = Trajectory(Line(length=2.0, direction=1.0), LINE.law, origin=(1.0, 0.5))
    points = [line.at((time - stamp) / SECOND) for time in times]
    active.take(Preview(times, *(np.array([getattr(p, part) for p in points]) for part in PARTS)))
    assert active.at(stamp)[:6] == pytest.approx(before[:6])
    assert active.position(stamp) == stamp
    step = SECOND // 20
    assert climber.follow(stamp + step) is Mode.APPROACHING
    end = active.at(int(active.way.times[-1]))
    assert end.speed == pytest.approx(0.0, abs=1e-9)
    climber.motion = climber.motion._replace(x=end.x + 1e-3)
    for later in range(stamp + 2 * step, stamp + SECOND, step):
        assert climber.follow(later) is Mode.APPROACHING
    assert active.way.pose[0] == pytest.approx((end.x, end.y, end.heading))
    assert active.way.pose[-1] == pytest.approx((1.0, 0.5, 1.0))


def test_what_is_expected_is_that_of_the_reference_around_the_climber():
    climber, law = AtRest(0.0), Guidance()
    active = climber.active
    assert climber.follow() is Mode.FOLLOWING

    def expected(stamp):
        return active.expected(stamp, active.at(stamp), law)

    early, late = expected(SECOND).allowed.speed, expected(4 * SECOND)
    progress = active.progress
    assert late.allowed.speed > early + 0.2
    assert late.wanted == (pytest.approx(0.5), 0)
    assert not late.waits
    for rate, waits in ((0.9, False), (0.0, True)):
        active.progress = progress._replace(pace=Pace(lag=0.1, rate=rate))
        assert expected(4 * SECOND).allowed.speed > late.allowed.speed
        assert expected(4 * SECOND).waits == waits
    active.progress = progress._replace(is_restarting=True)
    active.gentle = Guidance(catch_up_speed=3.0, catch_up_share=9.0)
    assert expected(4 * SECOND).allowed.speed > late.allowed.speed + 1.0
    active.progress = progress
    assert expected(4 * SECOND) == late
    slower = Trajectory(Line(length=2.0), RestToRest(rate=0.1, ramp_time=2.0))
    active.preview = sampled(slower, 5.0)
    assert expected(4 * SECOND).allowed.speed < late.allowed.speed
