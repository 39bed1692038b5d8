"""`python bench/plant.py [--figures DIR]`: the plant against what is known of its effects."""

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from plant_experiments import (
    EDGED,
    PUBLISHED,
    errors_by_step,
    found_period,
    friction_at,
    published,
    pulled,
    spring,
    stick_slip_period,
    swinging,
)

from climber_uk.mechanics.adhesion import Grip, NoAdhesion, Suction
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Coulomb, LuGre, Stribeck, Viscous
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Cylinder
from climber_uk.simulation.inputs import FellOff
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from robustness import BUILT

PAPER = Climber()


def stribeck_curve() -> Figure:
    """Friction over sliding speed: laws as lines, the plant as points."""
    figure, axes = plt.subplots(figsize=(6, 3.6))
    speeds, some = np.geomspace(1e-4, 1.0, 300), np.geomspace(1e-4, 1.0, 13)
    laws = {
        "Coulomb": Coulomb(),
        "viscous, v₁ = 0.5 m/s": Viscous(speed=0.5),
        "Stribeck": Stribeck(1.5, 1e-3, 0.4),
        "LuGre": PUBLISHED,
    }
    worst = 0.0
    for number, (name, law) in enumerate(laws.items()):
        found = np.array([friction_at(law, v, step=1e-5) for v in some.tolist()])
        worst = max(worst, float(np.abs(found / law.level(1.0, some) - 1).max()))
        lines = "--" if name == "LuGre" else "-"
        axes.semilogx(speeds, law.level(1.0, speeds) + 0 * speeds, lines, color=f"C{number}")
        axes.semilogx(some, found, "os^x"[number], color=f"C{number}", ms=5, label=name)
    axes.set(
        xlabel="sliding speed [m/s]", ylabel="friction [N]", title="lines: laws, points: plant"
    )
    axes.legend()
    print(f"Stribeck curve: plant within {worst:.1e} of the laws")
    return figure


def stick_slip() -> Figure:
    """A block pulled by a spring, 2 N/m, at 0.1 m/s."""
    figure, (above, below) = plt.subplots(2, sharex=True, figsize=(7, 4.6))
    ours = pulled(PUBLISHED, spring(), 40.0)
    theirs = published(spring(), 40.0, ours.time)
    edged = pulled(EDGED, spring(), 40.0)
    viscous = pulled(Viscous(speed=0.5), spring(), 40.0)
    for motion, name, style in (
        (ours, "LuGre, plant", "C0-"),
        (theirs, "LuGre, published equations", "k:"),
        (edged, "Stribeck, plant", "C1-"),
        (viscous, "viscous, plant", "C2-"),
    ):
        above.plot(motion.time, motion.x, style, label=name)
        below.plot(motion.time, motion.force, style)
    above.set(ylabel="block [m]")
    above.legend(fontsize="small")
    below.set(xlabel="t [s]", ylabel="spring's force [N]")
    print(f"stick-slip period: by hand {stick_slip_period():.4f} s, ", end="")
    sharper = pulled(replace(EDGED, speed=1e-4), spring(), 40.0)
    for law, motion in (("1e-3", edged), ("1e-4", sharper)):
        print(f"Stribeck with v_s = {law} m/s {found_period(motion):.4f} s, ", end="")
    print()
    print(f"LuGre: period {found_period(ours):.4f} s, published {found_period(theirs):.4f} s")
    off = np.abs(ours.x - theirs.x)
    print(f"LuGre: block within {off.max():.1e} m of the published equations")
    return figure


def pre_sliding() -> Figure:
    """Force up to 0.95 of break-away, and back."""
    figure, axes = plt.subplots(figsize=(6, 3.6))
    ours = pulled(PUBLISHED, swinging(), 10.0)
    theirs = published(swinging(), 10.0, ours.time)
    axes.plot(1e6 * ours.x, ours.force, "C0-", label="plant")
    axes.plot(1e6 * theirs.x, theirs.force, "k:", label="published equations")
    axes.set(xlabel="displacement [µm]", ylabel="force [N]")
    axes.legend()
    off, swing = np.abs(ours.x - theirs.x).max(), np.ptp(ours.x)
    print(f"pre-sliding: {off:.1e} m from the published equations, of a swing of {swing:.1e} m")
    return figure


def orders() -> Figure:
    """Error over the step."""
    figure, axes = plt.subplots(figsize=(6, 3.8))
    fast = State.rolling(np.array([0.0, 0.0, 0.3]), 6.0, 1.0)
    slow = State.rolling(np.array([0.0, 0.0, 0.3]), 0.6, 1.0)
    skidding = State(np.zeros(3), np.array([6.0, 2.0, 1.0]))
    floor = replace(PAPER, inclination=0.0)
    push, parts = np.array([1.4, 1.5]), [25, 50, 100, 200, 400]
    cases: dict[str, tuple[Callable[[float], Plant], State]] = {
        "Coulomb": (lambda h: Plant(PAPER, h), fast),
        "viscous": (lambda h: Plant(PAPER, h, Contact(friction=Viscous(speed=5.0))), fast),
        "Stribeck": (lambda h: Plant(PAPER, h, Contact(friction=Stribeck(speed=2.0))), fast),
        "LuGre": (
            lambda h: Plant(PAPER, h, Contact(friction=LuGre(speed=2.0, deflection=1.0))),
            slow,
        ),
        "ring, R = 0.1 m": (lambda h: Plant(PAPER, h, Contact(grip=Grip(seal_radius=0.1))), fast),
        "pipe, R = 2 m": (lambda h: Plant(PAPER, h, wall=Cylinder(2.0)), fast),
        "wheels that slip": (
            lambda h: Plant(floor, h, Contact(adhesion=NoAdhesion()), slip=True),
            skidding,
        ),
    }
    for number, (name, (plant, start)) in enumerate(cases.items()):
        duration = 0.2 if start is skidding else 1.0
        errors = errors_by_step(plant, start, push, duration, parts)
        steps = duration / np.array(parts)
        order = np.polyfit(np.log(steps[1:4]), np.log(errors[1:4]), 1)[0]
        axes.loglog(steps, errors, "osv^<>x"[number] + "-", ms=4, label=f"{name}: {order:.2f}")
        print(f"order, {name}: {order:.2f}")
    axes.set(xlabel="step [s]", ylabel="error of the pose")
    axes.legend(fontsize="small", title="order of the middle three")
    return figure


def suction_lost() -> Figure:
    """The climber of climber.yaml at rest, heading up; its pump lost at 5 s, leak of 1 s."""
    figure, rows = plt.subplots(3, sharex=True, figsize=(7, 5.4))
    for slip in (False, True):
        plant = Plant(BUILT, 0.0025, Contact(adhesion=Suction(pump_time=1.0)), slip=slip)
        start = State(np.array([0.0, 3.0, math.pi / 4]), np.zeros(3))
        physics = Physics(slip=slip, pressure_loss_time=5.0)
        robot = SimulatedRobot(Parts(plant, Motors(), Sensors(), physics), start, 0.005)
        table = []
        try:
            while True:
                _, y, _ = robot.state.pose
                table.append([robot.time, robot.pressure, *robot.margins(), y])
                robot.advance(np.zeros(2))
        except FellOff as fall:
            print(f"suction lost, slip {slip}: fell off at {robot.time:.3f} s: {fall}")
        time, pressure, slipping, tipping, y = np.array(table).T
        moved = time[np.abs(y - 3.0) > 0][0]
        low = time[slipping < 1][0]
        print(
            f"  moves from {moved:.3f} s on, at {np.interp(moved, time, pressure):.0f} Pa; ", end=""
        )
        print(f"slip margin below 1 from {low:.3f} s on; y at the end {y[-1]:.3f} m")
        style = "-" if slip else "--"
        if slip:
            rows[0].plot(time, pressure / 1000, "C0-")
            rows[1].semilogy(time, slipping, "C1-", label="slip margin")
            rows[1].semilogy(time, tipping, "C2-", label="tip margin")
        rows[2].plot(time, y, f"C3{style}", label=f"wheels {'may' if slip else 'do not'} slip")
    rows[1].axhline(1.0, color="k", lw=0.5)
    rows[0].set(ylabel="pressure [kPa]")
    rows[1].set(ylabel="margins")
    rows[2].set(xlabel="t [s]", ylabel="y [m]", xlim=(4.0, None))
    rows[1].legend()
    rows[2].legend()
    return figure


def paper_margins() -> Figure:
    """Slip margin along the paper's ellipse, one lap, from the torques that it takes."""
    figure, axes = plt.subplots(figsize=(6, 3.0))
    time = np.linspace(0, 2 * np.pi, 2001)
    now = Trajectory(Ellipse(), ConstantRate()).at(time)
    drive = 5 * now.forward_acceleration + PAPER.seal_friction + 49.05 * np.sin(now.heading)
    lateral = 5 * now.speed * now.yaw_rate + 49.05 * np.cos(now.heading)
    yaw_force = 0.33 * now.acceleration[:, 2] / PAPER.half_track
    forces = (drive + yaw_force) / 2, (drive - yaw_force) / 2
    margin = Contact().slip_margin(PAPER, 0.0, forces, lateral, -49.05 * np.cos(now.heading))
    share = float(np.mean(margin < 1))
    print(f"paper's ellipse: slip margin below 1 for {share:.1%} of a lap")
    print(f"  lowest {margin.min():.3f}")
    axes.plot(time, margin)
    axes.axhline(1.0, color="k", lw=0.5)
    axes.set(xlabel="t [s]", ylabel="slip margin", ylim=(0, 3))
    return figure


FIGURES = {
    "stribeck": stribeck_curve,
    "stick_slip": stick_slip,
    "pre_sliding": pre_sliding,
    "orders": orders,
    "suction_lost": suction_lost,
    "paper_margins": paper_margins,
}


def main() -> None:
    """Print the numbers; draw the figures if they are wanted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--figures", type=Path, help="directory for plant_*.png")
    options = parser.parse_args()
    if options.figures:
        options.figures.mkdir(parents=True, exist_ok=True)
    for name, draw in FIGURES.items():
        figure = draw()
        if options.figures:
            figure.tight_layout()
            figure.savefig(options.figures / f"plant_{name}.png", dpi=80)


if __name__ == "__main__":
    main()
