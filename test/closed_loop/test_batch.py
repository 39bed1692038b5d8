from dataclasses import asdict, replace

import numpy as np
import pytest

from climber_uk.closed_loop import period
from climber_uk.closed_loop.batch import Change, Loops
from climber_uk.closed_loop.period import BatchRun
from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.exact import Exact
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.control.safety import Safety
from climber_uk.control.time_scaling import Pacing
from climber_uk.control.timing import Timing
from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.many import indexed
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.mechanics.shapes import Ellipse, Lemniscate
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Odometer, Sensors

PAPER = Climber()
BUILT = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
ELLIPSE = Trajectory(Ellipse(), ConstantRate())
EIGHT = Trajectory(Lemniscate(1.5, 0.75), RestToRest(rate=0.12), origin=(0.0, 3.0))
SLOW = Guidance(cross_track_gain=3.0, fade_speed=0.1)
RANDOM = np.random.default_rng(8)
N = 4
COMPARED = 0, 3  # of each block one


def starts(x, y, heading, speed=0.0, yaw_rate=0.0):
    x, y, speed, yaw_rate = (np.broadcast_to(v, N) + np.zeros(N) for v in (x, y, speed, yaw_rate))
    heading = heading + 0.05 * RANDOM.normal(size=N)
    place = x + 0.01 * RANDOM.normal(size=N), y + 0.01 * RANDOM.normal(size=N)
    return Motion(*place, heading, np.cos(heading), np.sin(heading), speed, yaw_rate)


def around(value):
    return value * RANDOM.uniform(0.8, 1.2, N)


ON_ELLIPSE = starts(0.0, 6.0, 0.0, 10.0, -0.6)
ON_EIGHT = starts(0.0, 3.0, np.pi / 4)
CASES = {
    "from rest": (EIGHT, ON_EIGHT, BUILT, SLOW, {}, 2, 0),
    "exact": (ELLIPSE, ON_ELLIPSE, PAPER, Exact(), {}, 2, 0),
    "1 ms": (ELLIPSE, ON_ELLIPSE, PAPER, Guidance(), {}, 5, 0),
    "late": (ELLIPSE, ON_ELLIPSE, PAPER, Guidance(), {}, 2, 2),
    "others": (
        EIGHT,
        ON_EIGHT,
        replace(BUILT, mass=around(5.0), seal_friction_coefficient=around(0.6)),
        replace(SLOW, frequency=around(11.0)),
        {},
        2,
        0,
    ),
    "too weak": (ELLIPSE, ON_ELLIPSE, PAPER, SLOW, {"max_wheel_torque": around(0.4)}, 2, 0),
    "dc": (ELLIPSE, ON_ELLIPSE, PAPER, SLOW, {"no_load_wheel_rate": around(600.0)}, 2, 0),
}


def alone(case, i, duration, wall=None):
    """The same by the scalar `Controller` and the plant that integrates (30)."""
    trajectory, start, true, gains, known, steps, delay = case
    model = replace(BUILT if trajectory is EIGHT else PAPER, **known)
    law = ControlLaw(as_floats(model, i), as_floats(gains, i), wall=wall)
    timing = Timing(transport_delay=0.005 * delay)
    # of many, no side slip is learnt: their wheels hold
    observer, pacing = Observer(side_slip_bandwidth=0.0), Pacing(catch_up=0.0)
    settings = Settings(law, observer, timing, pacing)
    link = Link(step=0.005 / steps, delay=0.005 * delay)
    state = State.moving(Motion(*(float(number) for number in indexed(start, i))))
    # nor is there a guard, and its budget of force, over many
    controller = Controller(settings, Safety(max_jump=1e9), guard=UNGUARDED)
    course = trajectory, state, duration, controller, as_floats(true, i), link
    return simulate(*course, plant_of=lambda *of: Plant(*of, wall=wall or Plane()))


def as_floats(of, i):
    one = indexed(of, i)
    changed = {k: float(v) for k, v in asdict(one).items() if isinstance(v, np.floating)}
    return replace(one, **changed)


@pytest.mark.parametrize("name", CASES)
def test_each_of_many_is_what_it_is_alone(name):
    trajectory, start, true, gains, known, steps, delay = case = CASES[name]
    model = replace(BUILT if trajectory is EIGHT else PAPER, **known)
    timing = Timing(transport_delay=0.005 * delay)
    loops = Loops(start, true, ControlLaw(model, gains, ControlOptions()), timing=timing)
    duration = 0.5
    got = loops.run(BatchRun(trajectory, duration, steps=steps, delay=delay), block=3)
    for i in COMPARED:
        run = alone(case, i, duration)
        assert got.rms[i] == pytest.approx(run.rms(), abs=1e-9)
        assert got.worst[i] == pytest.approx(run.distance.max(), abs=1e-9)
        assert got.last[i] == pytest.approx(run.distance[-1], abs=1e-9)
        assert got.settled[i] == max(run.time[run.distance > 0.01], default=0.0)
        # a run tells what acted before a time, a loop what acts from it on
        most = np.abs(run.torques[1:]).max()
        assert most <= got.peak_torque[i] + 1e-9
    if name == "too weak":
        assert (got.saturated > 0.1).all()
        np.testing.assert_allclose(got.peak_torque, known["max_wheel_torque"], rtol=1e-12)
    else:
        np.testing.assert_array_equal(got.saturated, 0)


ROUND = {
    "tank": Tank(around(-5.0)),
    "pipe": Cylinder(3.0),
    "sphere": Sphere(around(4.0)),
    "roof": Cone(around(6.0)),
    "tilted": Plane(around(30.0)),
}


@pytest.mark.parametrize("name", ROUND)
def test_so_is_each_on_a_wall_that_is_round_or_tilted_and_may_be_of_its_own(name):
    wall, leaning = ROUND[name], replace(BUILT, inclination=70.0, mass=around(5.0))
    believed = replace(leaning, mass=5.0)
    law = ControlLaw(believed, SLOW, wall=wall)
    got = Loops(ON_EIGHT, leaning, law, wall=wall).run(BatchRun(EIGHT, 0.5), block=3)
    for i in COMPARED:
        case, its = (
            (EIGHT, ON_EIGHT, leaning, SLOW, {"inclination": 70.0}, 2, 0),
            as_floats(wall, i),
        )
        run = alone(case, i, 0.5, its)
        plant = Plant(as_floats(leaning, i), 0.0025, wall=its)
        # the weight changes within a period, but on a plane
        error = 1e-9 if name == "tilted" else 1e-7
        assert got.rms[i] == pytest.approx(run.rms(), abs=error)
        assert got.worst[i] == pytest.approx(run.distance.max(), abs=error)
        states = map(State, run.pose, run.velocity)
        tips = [plant.margins(state, np.zeros(2))[1] for state in states]
        assert got.tip_margin[i] == pytest.approx(min(tips), abs=1e-6)


def test_what_a_wall_turns_upside_down_falls_there():
    """Hardly held by its suction, from a pipe's side on to where its weight pulls it off."""
    weak = replace(BUILT, suction_pressure=np.array([200.0, 8000.0, 8000.0, 200.0]))
    pipe = Cylinder(3.0)
    start = indexed(ON_EIGHT, np.arange(N))._replace(y=np.array([4.6, 4.6, 0.0, 0.0]))
    loops = Loops(start, replace(weak, inclination=0.0), ControlLaw(BUILT, SLOW), wall=pipe)
    fell = loops.run(BatchRun(EIGHT, 0.1)).fell
    np.testing.assert_array_equal(fell, [0.0, np.inf, np.inf, np.inf])


def noisy(seeds):
    sensors = Sensors(position_noise=1e-3, heading_noise=1e-3, speed_noise=1e-2)
    law = ControlLaw(BUILT, SLOW)
    start = indexed(ON_EIGHT, np.arange(len(seeds)))
    return Loops(start, BUILT, law, sensors=sensors, seeds=seeds)


def test_a_seed_gives_the_same_noise_whatever_the_block_and_its_place_in_it():
    course, seeds = BatchRun(EIGHT, 0.2), np.array([5, 6, 7, 8])
    whole, blocks = (noisy(seeds).run(course, block=block) for block in (4, 1))
    np.testing.assert_allclose(whole.rms, blocks.rms, rtol=1e-12)
    same = replace(noisy(seeds), start=indexed(ON_EIGHT, np.zeros(4, int)), seeds=np.full(4, 3))
    outcome = same.run(course)
    np.testing.assert_allclose(outcome.rms, outcome.rms[0], rtol=1e-12)


def test_its_noise_is_that_of_the_plants_sensors():
    loops, state = noisy(np.array([9])), State(np.array([1.0, 2.0, 0.5]), np.array([0.1, 0.0, 0.2]))
    odometer = Odometer(replace(loops.sensors, seed=9), PAPER, 0.005, state)
    drawn = loops._noise(3)
    for _ in range(4):
        _, expected = odometer.latest()
        noise = next(drawn)[:, 0]
        told = loops.sensors.corrupted(state.motion, noise.tolist())
        np.testing.assert_array_equal([told.x, told.y, told.heading], expected.pose)
        odometer.measure(state, state, np.zeros(2))


def test_lost_suction_is_a_fall_of_those_that_lose_it_when_they_do():
    none = replace(BUILT, suction_pressure=300.0)  # it tips below 327 Pa
    change = Change(np.array([0.1, np.inf, 0.2, np.inf]), none)
    loops = Loops(ON_EIGHT, BUILT, ControlLaw(BUILT, SLOW, ControlOptions()), changes=(change,))
    outcome = loops.run(BatchRun(EIGHT, 0.3))
    np.testing.assert_allclose(outcome.fell, [0.1, np.inf, 0.2, np.inf])
    assert outcome.tip_margin[0] == pytest.approx(300 / 327)
    assert outcome.tip_margin[1] == pytest.approx(8000 / 327)
    stays = replace(loops, changes=()).run(BatchRun(EIGHT, 0.1))
    assert outcome.worst[0] == pytest.approx(stays.worst[0])  # what came after does not count


def test_friction_that_jumps_is_learnt():
    rough = replace(BUILT, seal_friction_coefficient=0.9)
    change = Change(np.array([0.2, 0.2, np.inf, np.inf]), rough)
    loops = Loops(ON_EIGHT, BUILT, ControlLaw(BUILT, SLOW, ControlOptions()), changes=(change,))
    outcome = loops.run(BatchRun(EIGHT, 1.0))
    assert (outcome.peak_torque[:2] > outcome.peak_torque[2:].max() + 0.1).all()
    assert (outcome.worst < 0.05).all()
    all_of_them = replace(loops, changes=(Change(0.2, rough),)).run(BatchRun(EIGHT, 1.0))
    np.testing.assert_allclose(all_of_them.rms[:2], outcome.rms[:2], rtol=1e-12)
    assert (all_of_them.peak_torque[2:] > outcome.peak_torque[2:] + 0.1).all()


@pytest.mark.parametrize(
    ("backend", "installed", "said"),
    [
        ("torch", True, "backend='torch' must be one of numpy, numba, jax"),
        ("jax", False, r"backend='jax' is not installed \(pip install jax\)"),
    ],
)
def test_what_cannot_compute_them_is_refused(backend, installed, said, monkeypatch):
    monkeypatch.setattr(period, "find_spec", lambda name: installed or None)
    with pytest.raises(ValueError, match=said):
        BatchRun(EIGHT, 1.0, backend=backend)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"sensors": Sensors(speed_noise=0.1)}, "seeds=None must be one for each loop"),
        (
            {"sensors": Sensors(odometry_source="wheels")},
            "odometry_source='wheels' must be 'truth'",
        ),
        ({"contact": Contact(grip=Grip(seal_radius=0.1))}, "seal_radius=0.1 must be 0.0"),
    ],
)
def test_what_only_one_climber_can_do_is_refused(changed, said):
    with pytest.raises(ValueError, match=said):
        Loops(ON_EIGHT, BUILT, ControlLaw(BUILT, SLOW, ControlOptions()), **changed)
