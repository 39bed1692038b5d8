"""`python bench/random_robots.py`: how many of random robots end in a limit cycle.

Each is a crawler as `climber.yaml` has it, but with a period, a lag, a delay, encoders, friction,
mass and inertia of its own, none of which its controller is told; then once more with what
`check_driver --move` would tell.
"""

import argparse
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from robustness import AT_REST, BUILT, EIGHT, SLOW_GUIDANCE, ours

from climber_uk.analysis.closed_loop import Link, simulate
from climber_uk.control.follower import Follower
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Stribeck

STEP = 0.0025  # [s] of the plant: of all times
CYCLE = 0.05  # [N m] RMS change of a torque from tick to tick, above which it chatters
OFF = 5e-3  # [m] RMS distance, above which it does not follow


class Robot(NamedTuple):
    """What a robot is in truth."""

    climber: Climber
    link: Link
    contact: Contact


def robot(seed: int) -> Robot:
    """The robot of a seed."""
    random = np.random.default_rng(seed)

    def times(longest: float) -> float:
        return STEP * float(random.integers(0, round(longest / STEP) + 1))

    link = Link(
        step=STEP,
        period=STEP * float(random.choice([2, 4, 6, 8])),
        torque_lag=random.uniform(0.0, 0.02),
        delay=times(0.0075),
        encoder_counts=int(random.choice([2048, 4096, 8192])),
    )
    climber = replace(
        BUILT,
        mass=BUILT.mass * random.uniform(0.8, 1.2),
        yaw_inertia=BUILT.yaw_inertia * random.uniform(0.8, 1.2),
        seal_friction_coefficient=BUILT.seal_friction_coefficient * random.uniform(0.5, 1.5),
    )
    return Robot(climber, link, Contact(friction=Stribeck(ratio=random.uniform(1.0, 1.6))))


def drive(follower: Follower, of: Robot, duration: float) -> tuple[float, float]:
    """RMS distance [m] and RMS change of a torque in a tick [N m], in the second half."""
    run = simulate(EIGHT, AT_REST, duration, follower, of.climber, of.link, contact=of.contact)
    late = run.time > duration / 2
    return run.rms(duration / 2), float(np.sqrt(np.mean(np.diff(run.torques[late], axis=0) ** 2)))
