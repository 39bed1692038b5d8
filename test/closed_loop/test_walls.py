"""A crawler on magnets on walls that are round, by a controller that knows their shape or not."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.build import build_controller
from climber_uk.control.safety import Mode
from climber_uk.mechanics.adhesion import Magnetic
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.mechanics.wall import WALLS as KINDS
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.simulation.plant import Plant

CONFIG = Path(__file__).parents[2] / "config" / "magnetic.yaml"
WALLS = {
    "upright tank": (Tank(-5.0), 90.0),
    "inside it": (Tank(5.0), 90.0),
    "leaning tank": (Tank(-5.0), 60.0),
    "cylinder": (Cylinder(-5.0), 90.0),
    "sphere": (Sphere(-5.0), 90.0),
    "roof": (Cone(6.0), 70.0),
    "tilted plane": (Plane(30.0), 80.0),
}
ROUND = [name for name in WALLS if name != "tilted plane"]
BRIEF = {"upright tank": 6.0}  # [s]
ASIDE = 2.0, 1.0  # [m] from the origin, where the wall is no longer as `inclination` says


def told(wall):
    """The controller's parameters of a wall."""
    [name] = (name for name, kind in KINDS.items() if kind is type(wall))
    return {"wall": name, **{f"{name}.{of}": value for of, value in asdict(wall).items()}}


def driven(name, seconds, origin=(0.0, 0.0), is_told=False):
    """Run on a wall, and the controller at its end."""
    wall, inclination = WALLS[name]
    believed = {**read_file(CONFIG, "/uk_torque_controller"), "inclination": inclination}
    believed |= told(wall) if is_told else {}
    places = {"origin_x": origin[0], "origin_y": origin[1]}
    planner = {**read_file(CONFIG, "/trajectory_publisher"), **places}
    trajectory = build_trajectory(Values(planner).read)
    climber = replace(Values(believed).read(Climber), inclination=inclination)
    contact = Contact(adhesion=Magnetic(force_at_contact=400.0))
    controller = build_controller(Values(believed), None)
    run = simulate(
        trajectory,
        State(trajectory.at(0.0).pose, np.zeros(3)),
        seconds,
        controller,
        climber,
        Link(period=0.01),
        plant_of=lambda climber, step: Plant(climber, step, contact, wall, slip=True),
    )
    print(
        f"{name}{' told' * is_told}, from {origin} m: {1e3 * run.rms():.4f} mm RMS, "
        f"{1e3 * run.distance.max():.4f} at most, {controller.estimator.disturbance.force:.2g} N"
    )
    return run, controller


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        *BRIEF.items(),
        *(pytest.param(name, 60.0, marks=pytest.mark.soak) for name in ROUND),
    ],
)
def test_on_what_is_round_magnets_stay_within_a_tenth_of_a_millimetre(name, seconds):
    run, _ = driven(name, seconds)
    assert run.distance.max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "roof",
        *(
            pytest.param(name, marks=pytest.mark.soak)
            for name in ("leaning tank", "sphere", "cylinder", "tilted plane")
        ),
    ],
)
def test_a_wall_that_is_told_leaves_nothing_to_be_learnt_wherever_it_starts(name):
    run, controller = driven(name, 6.0, ASIDE, is_told=True)
    untold, _ = driven(name, 6.0, ASIDE)
    assert controller.mode is Mode.FOLLOWING
    assert run.distance.max() < 3e-5
    assert run.distance.max() < untold.distance.max() / 5
    assert abs(controller.estimator.disturbance.force) < 1e-3


@pytest.mark.parametrize("name", WALLS)
def test_margins_of_a_controller_that_is_told_are_the_plants(name):
    """Slip, tip and load, as its node computes them, at random places, headings and speeds."""
    wall, inclination = WALLS[name]
    file = {**read_file(CONFIG, "/uk_torque_controller"), "inclination": inclination}
    law = build_controller(Values({**file, **told(wall)}), None).law
    contact = Contact(adhesion=Magnetic(force_at_contact=400.0))
    plant = Plant(law.climber, 0.0025, contact, wall)
    random = np.random.default_rng(3)
    for _ in range(20):
        pose = random.uniform([-2, -2, -3], [2, 2, 3])
        state = State.rolling(pose, random.uniform(-0.3, 0.3), random.uniform(-1, 1))
        torques = random.uniform(-4, 4, 2)
        motion, climber = state.motion, law.climber
        into, along, across = law.gravity(motion)
        lateral = climber.mass * motion.speed * motion.yaw_rate - across
        forces = tuple(torques / climber.wheel_radius)
        slip, tip = plant.margins(state, torques)
        assert contact.slip_margin(climber, into, forces, lateral, across) == pytest.approx(slip)
        assert contact.tip_margin(climber, into, along) == pytest.approx(tip)
        assert contact.wheel_load(climber, into) == pytest.approx(plant.wheel_load(state))


def test_on_a_leaning_tank_the_gravity_is_that_by_hand():
    """60° at the bottom line; an eighth of the way around, of a tank of 5 m, from outside."""
    file = {**read_file(CONFIG, "/uk_torque_controller"), "inclination": 60.0}
    law = build_controller(Values({**file, **told(Tank(-5.0))}), None).law
    x = 5.0 * np.pi / 4
    state = State.rolling(np.array([x, 0.7, 0.0]), 0.2, 0.0)
    into, along, across = law.gravity(state.motion)
    # 0.5 g into the wall where it begins; turned by 45° as x goes on around it
    assert into == pytest.approx(9.81 * 0.5 * np.sqrt(0.5) - 0.2**2 / 5)
    assert along == pytest.approx(9.81 * np.hypot(0.5 * np.sqrt(0.5), np.sqrt(0.75)))
    assert across == pytest.approx(-12 * 9.81 * np.sqrt(0.75))


@pytest.mark.parametrize("name", WALLS)
def test_at_rest_a_stop_carries_what_the_weight_is_there(name):
    wall, inclination = WALLS[name]
    file = {**read_file(CONFIG, "/uk_torque_controller"), "inclination": inclination}
    controller = build_controller(Values({**file, **told(wall)}), None)
    climber = controller.law.climber
    contact = Contact(adhesion=Magnetic(force_at_contact=400.0))
    plant = Plant(climber, 0.0025, contact, wall)
    pose = np.array([2.0, 1.0, 0.6])
    controller.enable(False)
    answer = None
    for tick in range(3):
        stamp = 10**9 + tick * 10**7
        answer = controller.on_odometry(stamp, stamp, State.rolling(pose, 0.0, 0.0).motion)
    assert answer is not None
    after = plant.advance(State.rolling(pose, 0.0, 0.0), answer.torques, 40)
    assert after.pose == pytest.approx(pose, abs=1e-9)


def test_a_plane_is_no_wall_to_the_law_and_costs_it_nothing():
    file = read_file(CONFIG, "/uk_torque_controller")
    assert build_controller(Values({**file, "wall": "plane"}), None).law.wall is None
    tilted = {**file, "plane.tilt": 10.0}
    assert build_controller(Values(tilted), None).law.wall == Plane(10.0)
