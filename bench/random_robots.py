"""`python bench/random_robots.py`: how many of random robots end in a limit cycle.

Each is a crawler as `climber.yaml` has it, but with a period, a lag, a delay, encoders, friction,
mass and inertia of its own, of which its controller is told nothing; then once more with the
`transport_delay` that `check_driver --move` tells it.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from multiprocessing import Pool
from typing import NamedTuple

import numpy as np
from robustness import AT_REST, BUILT, EIGHT, SLOW_GUIDANCE, SLOW_OBSERVER, ours

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.controller import Answer
from climber_uk.control.guard import UNGUARDED, GuardOptions
from climber_uk.driver_check.evidence import Arrival, motion_of
from climber_uk.driver_check.response import respond
from climber_uk.driver_check.trial import Bounds, Trial
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Stribeck
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import NO_TORQUES, Motion, State, Torques
from climber_uk.mechanics.shapes import SineWave
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages import writing
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors

STEP = 0.0025  # [s] of the plant: of all times
DURATION = 12.0  # [s], of which the second half counts
OFF, CHATTER = 5e-3, 0.05  # [m] RMS distance and [N m] RMS change of a torque: a limit cycle
AT_FIRST = 50  # messages at rest before a trial
FORTH_AND_BACK = Trajectory(
    SineWave(length=0.6, amplitude=0.1, wavelength=0.6),
    RestToRest(rate=0.25, ramp_time=0.5, runs=0, pause=0.0),
)
PATHS = {"eight": EIGHT, "forth_and_back": FORTH_AND_BACK}


class Robot(NamedTuple):
    """What a robot is in truth."""

    climber: Climber
    link: Link
    contact: Contact


class Result(NamedTuple):
    """How a robot drove."""

    distance: float  # RMS [m]
    chatter: float  # RMS change of a torque from tick to tick [N m]
    learnt: float  # delay [s]
    stopped: bool  # by the guard

    @property
    def cycles(self) -> bool:
        """Whether it ended in a limit cycle."""
        return not (self.distance < OFF and self.chatter < CHATTER)


def robot(seed: int) -> Robot:
    """The robot of a seed."""
    random = np.random.default_rng(seed)
    link = Link(
        step=STEP,
        period=STEP * float(random.choice([2, 4, 6, 8])),
        torque_lag=random.uniform(0.0, 0.02),
        delay=STEP * float(random.integers(0, 4)),
        sensors=Sensors(
            odometry_source="wheels",
            encoder_resolution=2 * np.pi / int(random.choice([2048, 4096, 8192])),
        ),
    )
    climber = replace(
        BUILT,
        mass=BUILT.mass * random.uniform(0.8, 1.2),
        yaw_inertia=BUILT.yaw_inertia * random.uniform(0.8, 1.2),
        seal_friction_coefficient=BUILT.seal_friction_coefficient * random.uniform(0.5, 1.5),
    )
    return Robot(climber, link, Contact(friction=Stribeck(ratio=random.uniform(1.0, 1.6))))


class Trying:
    """The trial of `check_driver --move`, in the controller's place."""

    def __init__(self, period: float) -> None:
        self.period, self.heard, self.trial = period, list[Arrival](), None

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Leave it be."""

    def on_odometry(self, now: int, stamp: int, motion: Motion) -> Answer | None:
        """Answer with the trial's torques, once it has begun."""
        state = State.moving(motion)
        self.heard.append(Arrival(writing.odometry(state, stamp, "odom", "base_link"), now, now, 0))
        if len(self.heard) == AT_FIRST:
            self.trial = Trial(BUILT, Bounds(), self.heard, self.period, False)
        told = self.trial.command(stamp, now, state) if self.trial else None
        return Answer(stamp, NO_TORQUES if told is None else Torques(*told.torques.tolist()), None)


def told(of: Robot) -> float:
    """The delay [s] that `check_driver --move` tells, and 0 if its trial tells none."""
    trying = Trying(of.link.period)
    simulate(
        EIGHT,
        AT_REST,
        10.0,
        trying,
        of.climber,
        of.link,
        plant_of=partial(Plant, contact=of.contact),
    )
    assert trying.trial is not None
    record = trying.trial.record()
    return respond(motion_of(trying.heard), record, BUILT).delay if record.pulses else 0.0


def driven(
    seed: int, path: Trajectory, delay_of: Callable[[Robot], float], guard: GuardOptions
) -> Result:
    """How the robot of a seed drives, told of a delay."""
    of = robot(seed)
    controller = ours(BUILT, SLOW_GUIDANCE, delay_of(of), SLOW_OBSERVER)
    controller.guard.options = guard
    run = simulate(
        path,
        State(path.at(0.0).pose, np.zeros(3)),
        DURATION,
        controller,
        of.climber,
        of.link,
        plant_of=partial(Plant, contact=of.contact),
    )
    late = DURATION / 2
    behind = path.at(
        run.time - controller.active.waited
    ).pose  # it waits for what has to break loose
    off = np.hypot(*(run.pose - behind)[run.time >= late, :2].T)
    distance, stopped = float(np.sqrt(np.mean(off**2))), bool(controller.guard.faults)
    return Result(distance, run.chatter(late), controller.estimator.latency.delay, stopped)


def untold(_: Robot) -> float:
    """No delay."""
    return 0.0


def main() -> None:
    """Print how many, and those that do."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="seed of the first one")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--guard", action="store_true", help="with the guard: whom does it stop?")
    what = "forth_and_back turns back, which is no limit cycle: it needs --guard"
    parser.add_argument("--path", choices=PATHS, default="eight", help=what)
    options = parser.parse_args()
    turns_back = options.path == "forth_and_back"
    if turns_back and not options.guard:
        parser.error("--path forth_and_back needs --guard: what turns back is no limit cycle")
    path = PATHS[options.path]
    guard = GuardOptions() if options.guard else UNGUARDED
    seeds = range(options.first, options.first + options.robots)
    with Pool(options.processes) as pool:
        for name, delay_of in (("told nothing", untold), ("told by check_driver", told)):
            drive = partial(driven, path=path, delay_of=delay_of, guard=guard)
            results = pool.map(drive, seeds, chunksize=1)
            cycles = [seed for seed, result in zip(seeds, results, strict=True) if result.cycles]
            worst = 1e3 * max(result.distance for result in results)
            if not turns_back:
                print(f"{name}: {len(cycles)} of {len(seeds)} in a limit cycle {cycles or ''}")
            print(f"{name}: largest RMS distance {worst:.2g} mm", flush=True)
            stopped = [seed for seed, result in zip(seeds, results, strict=True) if result.stopped]
            if options.guard:
                print(f"{name}: {len(stopped)} stopped by the guard {stopped or ''}", flush=True)


if __name__ == "__main__":
    main()
