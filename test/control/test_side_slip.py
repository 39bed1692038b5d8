"""Wheels that give way sideways: learnt from poses, and followed along the course that is left."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from climber_uk.closed_loop.simulate import Link, sampled, simulate
from climber_uk.control.active_reference import KEPT_BEHIND
from climber_uk.control.approach import ANYWHERE
from climber_uk.control.control_law import ControlInput, ControlLaw, ControlOptions
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.estimator import Estimator
from climber_uk.control.exact import Exact
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import DisturbanceEstimate, Observer, predict
from climber_uk.control.safety import Mode
from climber_uk.control.side_slip import STILL, Course, SideSlip, _ahead, shown
from climber_uk.control.timing import Timing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.quantities import Motion, ReferencePoint, State, Torques, Wrench
from climber_uk.mechanics.shapes import Circle, Line, SineWave
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Plane
from climber_uk.simulation.sensors import Sensors

CLIMBER = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
GAINS = Guidance(cross_track_gain=10.0, fade_speed=0.1)
CIRCLE = Trajectory(Circle(radius=0.5), RestToRest(rate=0.4, ramp_time=3.0))
SINE = Trajectory(
    SineWave(length=2.0, amplitude=0.2, wavelength=1.0), RestToRest(rate=0.15, ramp_time=2.0)
)
LINE = Trajectory(Line(length=2.0, direction=0.7), RestToRest(rate=0.2, ramp_time=2.0))
PERIOD, STEPS = 0.005, 5
numbers = st.floats(-1, 1)


class Scrubbing:
    """A climber on a wall whose wheels creep and scrub, and whose turning is resisted.

    Its seal drags against the motion, sideways as well.
    """

    def __init__(self, climber, pose, creep, scrub, resistance):
        self.climber, self.creep, self.scrub, self.resistance = climber, creep, scrub, resistance
        self.pose, self.v, self.omega, self.aside = np.array(pose, float), 0.0, 0.0, 0.0

    @property
    def state(self):
        """As a good odometry gives it."""
        x, y, heading = self.pose
        return State.moving(Motion.at(x, y, heading, self.v, self.omega), self.aside)

    def advance(self, torques):
        """A period, by Euler's steps."""
        climber, step = self.climber, PERIOD / STEPS
        force, moment = climber.wrench(*torques)
        for _ in range(STEPS):
            sine, cosine = np.sin(self.pose[2]), np.cos(self.pose[2])
            push = force - climber.weight_along_wall * sine
            drag = climber.seal_friction / max(math.hypot(self.v, self.aside), 1e-3)
            self.v = slid(self.v, push, drag * abs(self.v), step / climber.mass)
            self.omega = slid(self.omega, moment, self.resistance, step / climber.yaw_inertia)
            load = climber.weight_along_wall * cosine + drag * self.aside
            yields = self.scrub * abs(self.omega) / (climber.mass * GRAVITY)
            settles = 0.1 / (1 + yields * drag)  # or else it would not, at low speeds
            self.aside += settles * (self.creep * abs(self.v) - yields * load - self.aside)
            middle = self.pose[2] + step * self.omega / 2
            sine, cosine = np.sin(middle), np.cos(middle)
            along, left = np.array([cosine, sine]), np.array([-sine, cosine])
            self.pose[:2] += step * (self.v * along + self.aside * left)
            self.pose[2] += step * self.omega


def slid(rate, push, friction, by):
    """Rate after a step of Coulomb's friction; `by` is the step by the inertia."""
    free = rate + by * push
    return np.sign(free) * max(abs(free) - by * friction, 0.0)


def drive(trajectory, duration, constraints=GAINS, observer=None, **slip):
    """Distances from the reference [m], the controller, and all the modes there were."""
    law = ControlLaw(CLIMBER, constraints)
    controller = Controller(Settings(law, observer or Observer()), approach=ANYWHERE)
    controller.on_reference(0, sampled(trajectory, duration))
    plant = Scrubbing(CLIMBER, trajectory.at(0.0).pose, **slip)
    distances, modes = [], set()
    for tick in range(round(duration / PERIOD)):
        answer = controller.on_odometry(
            0, SECOND + round(tick * PERIOD * SECOND), plant.state.motion
        )
        modes.add(controller.mode)
        distances.append(plant.pose[:2] - trajectory.at(tick * PERIOD).pose[:2])
        plant.advance(answer.torques)
    return np.linalg.norm(distances, axis=1), controller, modes


@pytest.mark.parametrize(
    ("creep", "resistance"),
    [
        (0.03, 30.0),
        *(
            pytest.param(*it, marks=pytest.mark.soak)
            for it in [(0.0, 0.0), (0.03, 0.0), (-0.03, 0.0), (-0.03, 30.0), (0.0, 30.0)]
        ),
    ],
)
def test_a_climber_that_sags_while_it_turns_stays_on_its_circle(creep, resistance):
    slip = {"creep": creep, "scrub": 0.08, "resistance": resistance}
    distance, controller, modes = drive(CIRCLE, 12.0, **slip)
    assert modes == {Mode.FOLLOWING}  # it is no fault
    assert np.sqrt(np.mean(distance**2)) < 1e-3
    assert distance.max() < 4e-3
    assert controller.estimator.slip.scrub == pytest.approx(0.08, abs=0.005)


@pytest.mark.soak
def test_a_climber_that_sags_stays_on_bends_that_are_hardly_wider_than_it_sags():
    """Of 13 cm; it turns upwards after each crest, where its heading has to be ahead by 30°."""
    distance, _, modes = drive(SINE, 16.0, creep=0.0, scrub=0.08, resistance=34.0)
    assert modes == {Mode.FOLLOWING}
    assert np.sqrt(np.mean(distance**2)) < 5e-3
    assert distance.max() < 15e-3


def test_it_would_be_far_off_if_nothing_were_learnt():
    slip = {"creep": 0.0, "scrub": 0.08, "resistance": 30.0}
    distance, *_ = drive(CIRCLE, 9.0, observer=Observer(side_slip_bandwidth=0.0), **slip)
    assert np.sqrt(np.mean(distance**2)) > 1e-2


def test_creep_leaves_no_distance_on_a_line():
    slip = {"creep": 0.02, "scrub": 0.0, "resistance": 0.0}
    distance, *_ = drive(LINE, 11.0, **slip)
    assert distance[1000:1900].max() < 1e-4


@pytest.mark.parametrize("constraints", [GAINS, pytest.param(Exact(), marks=pytest.mark.soak)])
def test_where_wheels_hold_it_is_as_if_nothing_were_learnt(constraints):
    def distance(bandwidth):
        law = ControlLaw(CLIMBER, constraints)
        observer = Observer(side_slip_bandwidth=bandwidth)
        controller = Controller(Settings(law, observer), approach=ANYWHERE)
        start = State(CIRCLE.at(0.0).pose, np.zeros(3))
        return simulate(CIRCLE, start, 4.0, controller, CLIMBER).distance

    np.testing.assert_allclose(distance(6.0), distance(0.0), atol=1e-6)


@settings(deadline=None)
@given(
    st.sampled_from([Guidance(), Exact()]),
    st.tuples(numbers, numbers, st.floats(-3, 3), st.floats(0.1, 3), numbers),
    st.tuples(st.floats(-0.7, 0.7), numbers, numbers),
    st.tuples(numbers, numbers),
)
def test_on_a_course_the_closed_form_is_what_the_rows_give(constraints, motion, course, resists):
    friction, turning = 9.0 * resists[0], 20.0 * abs(resists[1])
    target = CIRCLE.at(1.5).target
    given_ = ControlInput(
        Motion.at(*motion),
        Torques(0.1, -0.2),
        Wrench(1.0, -0.3),
        PERIOD,
        0,
        friction,
        turning,
        0.01,
        Course.at(*course),
    )
    one, other = (
        ControlLaw(CLIMBER, constraints, ControlOptions(solver=solver)).command(given_, target)
        for solver in ("closed_form", "generic")
    )
    np.testing.assert_allclose(one.demanded, other.demanded, rtol=1e-9, atol=1e-9)


def turning(*coefficients):
    """A reference by its time, whose heading is this polynomial of it [rad]."""
    heading = np.polynomial.Polynomial([0.0, *coefficients])

    def at(later):
        derivatives = (heading.deriv(n)(later) if n else heading(later) for n in range(3))
        angle, rate, acceleration = (float(each) for each in derivatives)
        return ReferencePoint(later, 0.0, angle, 0.0, 0.0, rate, 0.0, 0.0, acceleration, 0.0, 0.0)

    return at


def is_ahead(at, lead, slope=0.0):
    """How far θ, with its derivatives, is from T θ̇ [rad], [rad/s], [rad/s²]."""
    wanted = at(0.0)
    angle, rate, acceleration = _ahead(wanted, at, lambda of, *_: lead + slope * of.x)
    rate, acceleration = rate + wanted.yaw_rate, acceleration + wanted.yaw_acceleration
    return angle - lead * rate, rate - wanted.yaw_rate - slope * rate - lead * acceleration


@given(st.floats(-0.29, 0.2), st.tuples(numbers, numbers, numbers))
def test_a_heading_that_has_to_be_ahead_solves_its_equation(lead, coefficients):
    off = is_ahead(turning(*0.1 * np.array(coefficients)), lead)
    assert off == pytest.approx((0.0, 0.0), abs=1e-9)


@given(st.floats(-0.7, 0.7), numbers, numbers)
def test_a_heading_ahead_goes_on_turning_beyond_what_is_seen(lead, rate, acceleration):
    assert is_ahead(turning(rate), lead) == pytest.approx((0.0, 0.0), abs=1e-9)
    at = turning(rate, acceleration)
    angle, *_ = _ahead(at(0.0), at, lambda *_: lead)
    off = lead * rate + 2 * lead**2 * acceleration - angle  # from what it is if that is seen, too
    assert abs(off) <= 0.42 * abs(acceleration) + 1e-9


@given(
    st.tuples(st.floats(-0.03, 0.03), st.floats(0.01, 0.15), st.floats(-0.04, 0.04)),
    st.tuples(st.floats(-3, 3), st.floats(-0.5, 0.5), st.floats(-1.5, 1.5)),
)
def test_what_slips_aside_is_what_the_seal_does_not_hold(parts, motion):
    """v_y solves its equation, and its derivatives are what small changes of the parts show."""
    heading, v, turning = motion
    moves, weight = Motion.at(0.0, 0.0, heading, v, turning), CLIMBER.mass * GRAVITY
    creep, scrub, pivot = parts
    aside, derivatives = SideSlip(*parts)._shown(CLIMBER, moves, None)
    held = CLIMBER.seal_friction * aside / np.hypot(np.hypot(v, aside), STILL)
    pull = v * turning / GRAVITY + np.cos(heading) + held / weight
    shown = creep * abs(v) - scrub * abs(turning) * pull + pivot * turning * np.sin(heading)
    assert aside == pytest.approx(shown, abs=1e-4)
    more = 1e-6 * np.eye(3)
    around = [
        [SideSlip(*(parts + sign * one)).speed(CLIMBER, moves) for sign in (1, -1)] for one in more
    ]
    slopes = np.array([after - before for after, before in around]) / 2e-6
    np.testing.assert_allclose(slopes, derivatives, atol=2e-2)


def test_what_is_learnt_at_one_speed_holds_at_another():
    """A seal that outweighs the climber holds it, the more, the slower it is as it turns."""
    scrub, turning, slip, errors = 0.12, 0.5, SideSlip(), []
    place, before = np.zeros(2), Motion.at(0.0, 0.0, 0.0, 0.2, turning)
    for v in [*np.full(600, 0.2), *np.linspace(0.2, 0.03, 200), *np.full(600, 0.03)]:
        speed, heading = float(v), before.heading + turning * PERIOD
        middle = Motion.at(*place.tolist(), heading - turning * PERIOD / 2, speed, turning)
        yields, aside = scrub * turning / (CLIMBER.mass * GRAVITY), 0.0
        for _ in range(30):  # what slides aside is dragged back
            drag = CLIMBER.seal_friction / np.hypot(speed, aside)
            aside = -yields * CLIMBER.lateral_reaction(middle) / (1 + yields * drag)
        along, left = (middle.cosine, middle.sine), (-middle.sine, middle.cosine)
        place = place + PERIOD * (speed * np.array(along) + aside * np.array(left))
        now = Motion.at(*place.tolist(), heading, speed, turning)
        slip, before = slip.learnt(CLIMBER, now, shown(before, now, PERIOD), PERIOD, 6.0), now
        errors.append(slip.speed(CLIMBER, now) - aside)
    assert np.abs(errors[500:]).max() < 2e-3  # [m/s] of 3e-2


def test_what_wheels_show_that_drive_harder_uphill_holds_downhill():
    """Tyres that pass on less along the climber hold less aside, by the friction's ellipse."""
    slip, errors = SideSlip(), []
    for time in np.arange(0.0, 4.3, PERIOD):  # over a crest
        target = SINE.at(float(time)).target
        x, y, speed = target.x, target.y, target.speed
        now = Motion.at(x, y, target.heading, speed, target.yaw_rate)
        drive = CLIMBER.seal_friction + CLIMBER.weight_along_wall * now.sine
        scrub = 0.146 / (1 + (CLIMBER.half_track * drive / 34.0) ** 2 / 2)
        aside = SideSlip(scrub=scrub, pivot=0.036).speed(CLIMBER, now)
        errors.append(slip.speed(CLIMBER, now) - aside)
        slip = slip.learnt(CLIMBER, now, aside, PERIOD, 6.0)
    assert np.abs(errors[600:]).max() < 1e-3  # [m/s] of 6e-2


@pytest.mark.parametrize("way", [1, -1])
def test_a_heading_is_as_far_ahead_as_its_sagging_asks_for(way):
    """On a sine wave of narrow bends; the equation is integrated from three seconds off."""
    scrub, pivot, found = 0.08, 0.015, []
    seal = CLIMBER.seal_friction / (CLIMBER.mass * GRAVITY)
    lead = partial(SideSlip(scrub=scrub, pivot=pivot)._lead, CLIMBER, None, way)

    def sagging(time, ahead):
        """-v_y / (v θ̇) of a climber whose heading is so far ahead of the reference."""
        point = SINE.at(time).target
        heading, v = point.heading + ahead, point.speed
        across = np.cos(heading) + v * point.yaw_rate / GRAVITY
        lever = float(way * scrub * across - pivot * np.sin(heading))
        return (lever - np.sign(lever) * scrub * seal * abs(ahead)) / v

    for now in np.arange(3.6, 11.0, 1.0):
        target = SINE.at(now).target
        sign = np.sign(sagging(now, 0.0))

        def slope(time, ahead, sign=sign):
            longest = max(sign * sagging(time, ahead[0]), 1e-3)
            return ahead / (sign * longest) - SINE.at(time).target.yaw_rate

        exact = solve_ivp(slope, (now + 3 * sign, now), [0.0], "LSODA", rtol=1e-6, atol=1e-6)
        at = lambda later, now=now: SINE.at(now + later).target  # noqa: E731
        angle, rate, _ = _ahead(target, at, lead)
        expected = exact.y[0, -1], slope(now, exact.y[:, -1])[0]
        found.append((angle - expected[0], rate - expected[1]))
    off = np.sqrt(np.mean(np.square(found), axis=0))
    assert off[0] < 0.02  # [rad] of 0.24
    assert off[1] < 0.05  # [rad/s] of 0.3


@given(*(st.floats(-most, most) for most in (3.0, 0.05, 0.15, 0.3, 1.0)), st.floats(0.1, 0.3))
def test_to_its_constraints_a_climber_that_turns_otherwise_has_wheels_that_hold(
    heading, off, lever, angle, turning, v
):
    """It goes aside by a lever times what it turns: to first order of how far it is off."""
    wanted, step = 0.7, 1e-6  # [rad/s], [s]

    def seen(time):
        at = heading + off + turning * time
        aside = (v * np.tan(angle) - lever * (turning - wanted)) * time
        x = v * time * np.cos(at) - aside * np.sin(at)
        y = v * time * np.sin(at) + aside * np.cos(at)
        course = Course.at(angle, 0.0, 0.0, lever, heading + wanted * time)
        return course.motion(Motion.at(float(x), float(y), float(at), v, turning))

    before, after = seen(0.0), seen(step)
    speed = before.speed * before.cosine, before.speed * before.sine
    went = (after.x - before.x) / step, (after.y - before.y) / step
    assert went == pytest.approx(speed, abs=1.1 * wanted * abs(lever * off) + 1e-5)


@pytest.mark.parametrize(("source", "learnt"), [("odometry", 0.01), ("pose", 0.0)])
def test_a_side_slip_that_odometry_tells_counts_where_it_is_to(source, learnt):
    """Its poses show none."""
    observer = Observer(side_slip_source=source)
    estimator = Estimator(CLIMBER, observer, Timing(control_period=PERIOD))
    for number in range(400):
        now = Motion.at(0.2 * PERIOD * number, 0.0, 0.0, 0.2, 0.0)
        estimator.see(SECOND + round(number * PERIOD * SECOND), now, 0.01)
        estimator.sent(estimator.stamp, Torques(0.0, 0.0))
    assert estimator.slip.speed(CLIMBER, now) == pytest.approx(learnt, abs=1e-4)


@given(st.floats(-0.5, 0.5))
def test_a_pose_that_jumps_is_hardly_a_side_slip(jump):
    """Of a climber that goes straight on before and after."""
    slip, before = SideSlip(), Motion.at(0.0, 0.0, 0.3, 0.2, 0.0)
    for number in range(1, 200):
        way = 0.2 * PERIOD * number
        x, y = way * np.cos(0.3) - jump * np.sin(0.3), way * np.sin(0.3) + jump * np.cos(0.3)
        now = Motion.at(float(x), float(y), 0.3, 0.2, 0.0)
        slip, before = slip.learnt(CLIMBER, now, shown(before, now, PERIOD), PERIOD, 6.0), now
        assert abs(slip.creep) < 0.2
    assert abs(slip.creep) < 0.01


@pytest.mark.parametrize(
    ("noise", "most"), [pytest.param(1e-3, 0.6e-3, marks=pytest.mark.soak), (3e-3, 3e-3)]
)
def test_noise_of_poses_is_no_side_slip_and_no_missing_twist(noise, most):
    """The twist is that of encoders: exactly zero at rest, and clean under way."""
    modes = set()

    class Watched(Controller):
        def on_odometry(self, *told):
            answer = super().on_odometry(*told)
            modes.add(self.mode)
            return answer

    controlling = Watched(Settings(ControlLaw(CLIMBER, GAINS), Observer()), approach=ANYWHERE)
    link, start = Link(sensors=Sensors(position_noise=noise)), State(LINE.at(0).pose, np.zeros(3))
    run = simulate(LINE, start, 8.0, controlling, CLIMBER, link)
    assert modes == {Mode.FOLLOWING}
    assert run.rms() < most


@given(*(st.floats(-1, 1) for _ in range(4)), st.floats(-3, 3), st.floats(-180, 180))
def test_on_a_tilted_wall_it_slips_as_upright_on_one_that_is_not(
    v, v_1, omega, aside, heading, tilt
):
    """Learnt and followed, both seen from where downhill is."""

    def seen(tilted):
        turned = np.radians(tilt) if tilted else 0.0
        wall = Plane(tilt) if tilted else None
        before = Motion.at(0.0, 0.0, heading + turned, v, omega)
        middle = heading + turned + omega * PERIOD / 2
        x, y = PERIOD * np.array(
            [
                v * np.cos(middle) - aside * np.sin(middle),
                v * np.sin(middle) + aside * np.cos(middle),
            ]
        )
        end = Motion.at(float(x), float(y), heading + turned + omega * PERIOD, v + v_1, omega)
        moved = shown(before, end, PERIOD)
        slip = SideSlip(scrub=0.1).learnt(CLIMBER, end, moved, PERIOD, 6.0, wall)
        speeds = v * np.cos(heading + turned), v * np.sin(heading + turned)
        point = ReferencePoint(0.0, 0.0, heading + turned, *speeds, omega, *np.zeros(5).tolist())
        course = slip.course(CLIMBER, point, lambda _: point, wall)
        parts = *slip[:-1], *slip.covariance, *(course[:-1] if course else ())
        return *parts, slip.speed(CLIMBER, end, wall)

    assert seen(tilted=True) == pytest.approx(seen(tilted=False), abs=1e-9)


def test_resisted_turns_end_and_do_not_begin_below_the_resistance():
    still = Motion.at(0.0, 0.0, 0.0, 0.0, 0.0)
    assert predict(CLIMBER, still, 0.0, 29.0, PERIOD, turning=30.0).yaw_rate == 0
    assert predict(CLIMBER, still, 0.0, 31.0, PERIOD, turning=30.0).yaw_rate > 0
    turns = still._replace(yaw_rate=0.1)
    assert predict(CLIMBER, turns, 0.0, 0.0, PERIOD, turning=30.0).yaw_rate == pytest.approx(0.0)
    many = still._replace(yaw_rate=np.array([0.0, 0.1, -0.5]))
    moments = np.array([29.0, 0.0, 3.0])
    got = predict(CLIMBER, many, 0.0, moments, PERIOD, turning=np.full(3, 30.0)).yaw_rate
    one = [
        predict(CLIMBER, still._replace(yaw_rate=rate), 0.0, moment, PERIOD, turning=30.0).yaw_rate
        for rate, moment in zip([0.0, 0.1, -0.5], [29.0, 0.0, 3.0], strict=True)
    ]
    np.testing.assert_allclose(got, one, atol=1e-12)


@given(st.floats(-40, 40), st.sampled_from([-1.0, 0.0, 1.0]), st.floats(-2, 2), st.floats(0, 50))
def test_what_is_learnt_of_turning_adds_up(change, direction, rate, turning):
    learnt = DisturbanceEstimate(moment=2.0, turning=turning)
    moment, after = learnt.turned(CLIMBER, change, direction, rate)
    assert moment - direction * after == pytest.approx(2.0 - direction * turning + change)
    assert after >= 0


@given(
    *(st.floats(-most, most) for most in (10.0, 20.0, 3.0, 20.0)),
    st.sampled_from([0.001, 0.005, 0.02]),
)
def test_an_arc_on_wheels_that_hold_shows_no_side_slip(v, v_1, omega, omega_1, time):
    steps = 2000
    middle = (np.arange(steps) + 0.5) * time / steps
    heading = 0.3 + omega * middle + omega_1 * middle**2 / 2
    way = (v + v_1 * middle) * time / steps
    before = Motion.at(0.0, 0.0, 0.3, v, omega)
    x, y = float(way @ np.cos(heading)), float(way @ np.sin(heading))
    end = 0.3 + omega * time + omega_1 * time**2 / 2
    now = Motion.at(x, y, end, v + v_1 * time, omega + omega_1 * time)
    learnt = SideSlip().learnt(CLIMBER, now, shown(before, now, time), time, 1.0)
    turned = abs(omega) * time + abs(omega_1) * time**2
    assert abs(learnt.offset) <= 1e-9 + (abs(v) + abs(v_1) * time) * time * turned**3


@given(st.floats(0.01, 1.0), st.floats(0.0, 30.0))
def test_no_more_of_the_reference_counts_than_has_come_in_any_case(scrub, now):
    """Else a run in lock-step would not repeat itself, as previews come when they come."""
    looked_at = []

    def at(later):
        looked_at.append(later)
        return CIRCLE.at(now + later).target

    SideSlip(scrub=scrub).course(CLIMBER, CIRCLE.at(now).target, at)
    # trajectory_publisher publishes 1 s, ten times a second, in points of 0.05 s; 0.15 s to spare
    assert max(looked_at, default=0.0) <= 1.0 - 0.1 - 0.05 - 0.15 + 1e-9
    assert min(looked_at, default=0.0) >= -KEPT_BEHIND / SECOND / 2
