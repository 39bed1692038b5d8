"""`python bench/robustness.py`: how the controller copes, row by row, beside others.

Lock-step at 200 Hz, controller and plant in one process: the classes that the nodes run.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.util import find_spec

import numpy as np
from identification_experiments import SCENARIOS, Scenario
from margins import simulated_margins
from rivals import LQR, AdaptiveRobust, Integrating, Kanayama, SuperTwisting, Weights
from scipy.spatial import cKDTree

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.approach import ANYWHERE
from climber_uk.control.constraint_set import ConstraintSet
from climber_uk.control.control_law import ControlLaw, ControlOptions, ForceLaw
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.exact import Exact
from climber_uk.control.guard import UNGUARDED
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.control.safety import Safety
from climber_uk.control.timing import Timing
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.simulation.sensors import Sensors

PAPER_RUN, BUILT_RUN = SCENARIOS["paper.yaml"], SCENARIOS["climber.yaml"]
PAPER, BUILT = PAPER_RUN.believed, BUILT_RUN.believed
ELLIPSE, EIGHT = PAPER_RUN.trajectory, BUILT_RUN.trajectory
IN_MOTION, AT_REST = PAPER_RUN.start, BUILT_RUN.start
RAMPED = Trajectory(Ellipse(), RestToRest(rate=1.0, ramp_time=3.0, laps=9))
GUIDANCE, OBSERVER, IDEAL = PAPER_RUN.guidance, PAPER_RUN.observer, Link()
SLOW_GUIDANCE, SLOW_OBSERVER = BUILT_RUN.guidance, BUILT_RUN.observer
NOISE = Link(
    sensors=Sensors(position_noise=1e-3, heading_noise=1e-3, speed_noise=1e-2, yaw_rate_noise=1e-2)
)


# Found by `tune.py`, the weights by `tune.py LQR`, with an observer of this bandwidth [1/s].
RIVALS_BANDWIDTH = 14.0
WEIGHTS = Weights(33_300.0, 112_000.0, 23_900.0, 54.0, 62.7)
KANAYAMA = Kanayama(8.03, 1.73, 1.24, 18.2, 112.0, 17.4, 185.0)
SUPER_TWISTING = SuperTwisting(4.91, 0.573, 1.1, 4.63, 24.9, 5.29, 20.5)

Make = Callable[..., Controller]
MILLIMETRE = 1e-3


def ours(
    climber: Climber,
    gains: ConstraintSet = GUIDANCE,
    delay: float = 0.0,
    observer: Observer = OBSERVER,
    controller: type[Controller] = Controller,
    other: ForceLaw | None = None,
) -> Controller:
    """The controller as the node runs it."""
    law = ControlLaw(climber, gains, ControlOptions(), other)
    timing = Timing(transport_delay=delay)
    return controller(Settings(law, observer, timing), Safety(), ANYWHERE, UNGUARDED)


def without_observer(
    climber: Climber,
    gains: Guidance = GUIDANCE,
    delay: float = 0.0,
    observer: Observer = OBSERVER,
) -> Controller:
    """Ours, believing its model."""
    return ours(climber, gains, delay, replace(observer, bandwidth=0.0))


def exact(
    climber: Climber,
    gains: Guidance = GUIDANCE,
    delay: float = 0.0,
    observer: Observer = OBSERVER,
) -> Controller:
    """Ours with the other constraint set."""
    return ours(climber, Exact(), delay, observer)


def rival(law: ForceLaw | None, controller: type[Controller] = Controller) -> Make:
    """A law in the constraints' place; one with a `controller` of its own has no observer."""
    bandwidth = RIVALS_BANDWIDTH if controller is Controller else 0.0

    def make(
        climber: Climber,
        gains: Guidance = GUIDANCE,
        delay: float = 0.0,
        observer: Observer = OBSERVER,
    ) -> Controller:
        observer = replace(observer, bandwidth=bandwidth)
        return ours(climber, gains, delay, observer, controller, law and replace(law))

    return make


KINDS: dict[str, Make] = {
    "UK": ours,
    "UK, no observer": without_observer,
    "UK, exact": exact,
    "LQR": rival(LQR(WEIGHTS)),
    "Kanayama + PI": rival(KANAYAMA, Integrating),
    "super-twisting": rival(SUPER_TWISTING, Integrating),
    "UK, adaptive": rival(None, AdaptiveRobust),
}
if find_spec("casadi"):
    from nmpc import NMPC

    KINDS["NMPC"] = rival(NMPC(WEIGHTS))


def lap(
    make: Make,
    climber: Climber = PAPER,
    delay: float = 0.0,
    after: float = 0.0,
    link: Link = IDEAL,
    duration: float = 20.0,
) -> float:
    """RMS [mm] on the paper's ellipse of a controller that believes in the paper's climber."""
    run = simulate(ELLIPSE, IN_MOTION, duration, make(PAPER, delay=delay), climber, link)
    return run.rms(after) / MILLIMETRE


def friction(make: Make, duration: float = 20.0) -> float:
    """RMS [mm] after 2 s, the worse of half and one and a half times the friction."""
    climbers = [replace(PAPER, seal_friction_coefficient=share * 0.8) for share in (0.5, 1.5)]
    return max(lap(make, climber, after=2.0, duration=duration) for climber in climbers)


def heavier(make: Make) -> float:
    """RMS [mm] with a fifth more mass and inertia."""
    return lap(make, replace(PAPER, mass=1.2 * PAPER.mass, yaw_inertia=1.2 * PAPER.yaw_inertia))


def without_twist(make: Make) -> float:
    """RMS [mm] after 2 s on the ramped ellipse, with noisy odometry that has a pose only."""
    controlling = make(PAPER, observer=replace(OBSERVER, velocity_source="pose"))
    link = replace(NOISE, with_twist=False)
    start = State(RAMPED.at(0.0).pose, np.zeros(3))
    return simulate(RAMPED, start, 10.0, controlling, PAPER, link).rms(after=2.0) / MILLIMETRE


def slow_odometry(make: Make, duration: float = 57.0) -> float:
    """RMS [mm] on the figure of eight of climber.yaml, at 20 Hz."""
    controlling = make(BUILT, SLOW_GUIDANCE, observer=SLOW_OBSERVER)
    return (
        simulate(EIGHT, AT_REST, duration, controlling, BUILT, Link(period=0.05)).rms() / MILLIMETRE
    )


def at_the_end(make: Make) -> float:
    """Distance [mm] from the end of that figure of eight at 200 Hz."""
    controlling = make(BUILT, SLOW_GUIDANCE, observer=SLOW_OBSERVER)
    return simulate(EIGHT, AT_REST, 57.0, controlling, BUILT).distance[-1] / MILLIMETRE


def from_anywhere(make: Make) -> tuple[float, float]:
    """100 random starts: last time [s] further than 1 cm off, and largest heading error [deg]."""
    climber = replace(PAPER, max_wheel_torque=4.0)
    late, turned = [], []
    for seed in range(100):
        random = np.random.default_rng(seed)
        offset = np.array([*random.uniform(-0.5, 0.5, 2), random.uniform(-1, 1)])
        start = State(RAMPED.at(0.0).pose + offset, np.zeros(3))
        run = simulate(RAMPED, start, 4.0, make(climber), climber)
        late.append(max(run.time[run.distance > 0.01], default=0.0))
        turned.append(np.abs(run.error[:, 2]).max())
    return max(late), np.degrees(max(turned))


def too_weak(make: Make) -> tuple[float, float, float]:
    """Torque limit at 70 % of the need from 5 to 7 s: off the path, lag and overshoot [m]."""
    need = np.abs(simulate(ELLIPSE, IN_MOTION, 20.0, ours(PAPER), PAPER).torques).max()
    weak = replace(PAPER, max_wheel_torque=0.7 * float(need))
    controlling = make(PAPER)

    def climber(time: float) -> Climber:
        now = weak if 5.0 <= time < 7.0 else PAPER
        if controlling.law.climber is not now:
            controlling.law = replace(controlling.law, climber=now)
        return now

    run = simulate(ELLIPSE, IN_MOTION, 40.0, controlling, climber)
    off, _ = cKDTree(ELLIPSE.path(400_000)[:, :2]).query(run.pose[:, :2])
    ahead, later = run.error[:, 0], run.time > 7.5
    return off.max(), -ahead[~later].min(), max(ahead[later].max(), 0.0)


def interrupted(make: Make, duration: float = 20.0) -> tuple[float, int]:
    """30 % of odometry lost, the rest up to 20 ms late: RMS [mm], and steps not followed."""
    controlling = make(PAPER)
    stops = 0

    def climber(_: float) -> Climber:
        nonlocal stops
        stops += controlling.mode.is_fault
        return PAPER

    run = simulate(ELLIPSE, IN_MOTION, duration, controlling, climber, Link(loss=0.3, jitter=0.02))
    return run.rms() / MILLIMETRE, stops


def untold(make: Make, link: Link, gains: Guidance = SLOW_GUIDANCE) -> tuple[float, float]:
    """RMS [mm], and RMS change of a torque in a tick [N m], of what nobody told the controller."""
    run = simulate(EIGHT, AT_REST, 57.0, make(BUILT, gains, observer=SLOW_OBSERVER), BUILT, link)
    return run.rms() / MILLIMETRE, run.chatter()


def margins(make: Make, scenario: Scenario) -> tuple[float, float]:
    """Longest delay and lag [ms] that nobody told the controller, and that it does not learn."""
    observer = scenario.observer
    return simulated_margins(
        scenario, lambda: make(scenario.believed, scenario.guidance, observer=observer)
    )


def links() -> dict[str, Link]:
    """Delays and lags as robots have them."""
    wheels = Sensors(odometry_source="wheels", encoder_resolution=2 * np.pi / 4096)
    encoders = Link(sensors=wheels, delay=0.005, torque_lag=0.005)
    return {
        "a delay of 20 ms": Link(delay=0.02),
        "a lag of 35 ms": Link(torque_lag=0.035),
        **{
            f"encoders at {1 / period:.0f} Hz, 5 + 5 ms": replace(encoders, period=period)
            for period in (0.005, 0.01, 0.02, 0.05)
        },
    }


ROWS: dict[str, tuple[str, Callable[[Make], object]]] = {
    "paper's ellipse": ("mm", lap),
    "seal friction ±50 %, after 2 s": ("mm", friction),
    "mass and inertia +20 %": ("mm", heavier),
    "a sample of delay, known": ("mm", lambda make: lap(make, delay=0.005, link=Link(delay=0.005))),
    "a sample of delay, unknown": ("mm", lambda make: lap(make, link=Link(delay=0.005))),
    "noise 1 mm, 1 mrad, 10 mm/s": ("mm", lambda make: lap(make, link=NOISE)),
    "the same noise, no twist": ("mm", without_twist),
    "climber.yaml with 20 Hz odometry": ("mm", slow_odometry),
    "climber.yaml, at the end": ("mm", at_the_end),
    "30 % lost, 20 ms jitter": ("mm, stops", interrupted),
    "100 starts: last time off, turned": ("s, deg", from_anywhere),
    "limit at 70 %: off, lag, overshoot": ("m", too_weak),
    "delay, lag borne, climber.yaml": ("ms", partial(margins, scenario=BUILT_RUN)),
    "delay, lag borne, paper.yaml": ("ms", partial(margins, scenario=PAPER_RUN)),
    **{
        f"{name}, {whose}": ("mm, N m", partial(untold, link=link, gains=gains))
        for whose, gains in (("climber.yaml", SLOW_GUIDANCE), ("default gains", GUIDANCE))
        for name, link in links().items()
    },
}


def said(value: object) -> str:
    """Return one or several figures, short."""
    return " / ".join(f"{part:.3g}" for part in (value if isinstance(value, tuple) else (value,)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="rows whose name contains this")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=[*KINDS], help="columns")
    options = parser.parse_args()
    np.seterr(all="ignore")  # a rival may diverge
    print(f"{'':<46}{'':<10}" + "".join(f"{name:>22}" for name in options.kinds))
    for name, (unit, row) in ROWS.items():
        if options.only in name:
            print(f"{name:<46}{unit:<10}", end="", flush=True)
            for kind in options.kinds:
                print(f"{said(row(KINDS[kind])):>22}", end="", flush=True)
            print()


if __name__ == "__main__":
    main()
