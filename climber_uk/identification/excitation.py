"""A trajectory that excites a climber's mass, inertia and friction as well as limits allow.

Of each candidate the torques follow from the model, and from the `integral_equations` the widths of
the intervals that odometry with 1 mm, 1 mrad and 10 mm/s of noise would leave; the best is the one
whose worst interval is narrowest.
"""

import dataclasses
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from climber_uk.identification.estimation import CUT, LEAST_WINDOWS, SITE, predicted
from climber_uk.identification.identified import DRIVE, NAMES, YAW, Identified
from climber_uk.identification.integral_equations import Site, integral
from climber_uk.identification.recorded_motion import RecordedMotion
from climber_uk.mechanics import Array, cross, unpack
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import sign, sin
from climber_uk.mechanics.shapes import Circle, Ellipse, Lemniscate, Line, Shape
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.declaration import parameter, parameters

PERIOD = 0.02  # [s]
AMPLE = 1.6  # times the least number of windows
RAMPS = (0.5, 1.0, 2.0, 4.0)  # [s]
# the others are shown by any motion with wheel angles, or are no part of the plan
SHOWN = ~np.isin(NAMES, ("wheel_radius", "half_track", "rotor_inertia"))
SOUGHT = np.isin(NAMES, ("mass", "seal_friction_coefficient", "yaw_inertia"))


@parameters
class ExcitationLimits:
    """Limits of the trajectory."""

    size: float = parameter(
        2.0, "m", "side of the square that it stays in: too large, and the wall may end", above=0
    )
    speed: float = parameter(
        0.3, "m/s", "highest speed: too low, and friction shows less, too high, slip more", above=0
    )
    torque: float = parameter(
        4.0, "N m", "highest torque of a wheel: motors that give less do not follow", above=0
    )
    duration: float = parameter(
        60.0, "s", "longest time: too short, and intervals are wide", above=0, at_most=3600
    )


@dataclass(frozen=True)
class ExcitationPlan:
    """A trajectory, and what would be identified from it."""

    name: str  # of the shape
    trajectory: Trajectory
    expected: Identified

    @property
    def is_short(self) -> bool:
        """Whether it has too few windows, should some be lost to noise."""
        counts = [len(self.expected.windows[kind]) for kind in (DRIVE, YAW)]
        return min(counts) < AMPLE * LEAST_WINDOWS

    @property
    def worst(self) -> float:
        """Largest uncertainty; infinite if a parameter is not shown at all."""
        shown = np.where(self.expected.sought, self.expected.uncertainty, np.inf)
        return float(shown[SHOWN].max())

    @property
    def parameters(self) -> dict[str, Any]:
        """Parameters of `trajectory_publisher`, by name."""
        shape, law = asdict(self.trajectory.shape), asdict(self.trajectory.law)  # type: ignore[call-overload]
        values = {f"{self.name}.{name}": value for name, value in shape.items()}
        values |= {f"rest_to_rest.{name}": value for name, value in law.items()}
        return {"shape": self.name, "time_law": "rest_to_rest", "reverse_gear": False, **values}


def plan(
    climber: Climber,
    limits: ExcitationLimits,
    origin: tuple[float, float] = (0.0, 0.0),
    site: Site = SITE,
) -> ExcitationPlan:
    """The best of the candidates within the limits; `ValueError` if there is none."""
    found = list(_plans(climber, limits, origin, site))
    if not found:
        rules = dataclasses.fields(limits)
        said = [f"{of.name} {getattr(limits, of.name):g} {of.metadata['unit']}" for of in rules]
        raise ValueError(f"no trajectory keeps within {', '.join(said)}")
    return min(found, key=lambda one: (one.is_short, one.worst))


def _plans(
    climber: Climber, limits: ExcitationLimits, origin: tuple[float, float], site: Site
) -> Iterator[ExcitationPlan]:
    for name, shape in _shapes(limits.size):
        if site.scrubs and _sharpest(shape) < climber.half_track:
            continue
        for ramp_time in RAMPS:
            trajectory = Trajectory(shape, _law(shape, ramp_time, limits), origin=origin)
            if trajectory.duration > limits.duration:
                continue
            motion, torques = driven(trajectory, climber)
            is_long = len(CUT.windows(motion)) >= LEAST_WINDOWS
            if is_long and np.abs(torques).max() <= limits.torque:
                yield ExcitationPlan(name, trajectory, predicted(motion, climber, site=site))


def _shapes(size: float) -> Iterator[tuple[str, Shape]]:
    """Names and shapes that fit into a square of side `size` [m]."""
    half = size / 2
    yield "line", Line(size, np.pi / 2)
    for share in (1.0, 0.5, 0.25):
        yield "circle", Circle(share * half)
        yield "ellipse", Ellipse(half, share * half)
        yield "lemniscate", Lemniscate(half, share * half)
        yield "lemniscate", Lemniscate(share * half, half)


def _sharpest(shape: Shape) -> float:
    """Least radius of its bends [m]: below the half track, the wheels inside would roll back."""
    _, slope, curving, *_ = shape.derivatives(np.linspace(0, shape.length, 1000))
    bend = np.maximum(np.abs(cross(slope, curving)), 1e-9)
    return float((np.linalg.norm(slope, axis=-1) ** 3 / bend).min())


def _law(shape: Shape, ramp_time: float, limits: ExcitationLimits) -> RestToRest:
    """From rest to the highest speed and back, as often as there is time for."""
    _, slope, *_ = shape.derivatives(np.linspace(0, shape.length, 1000))
    rate = limits.speed / float(np.linalg.norm(slope, axis=-1).max())
    once = RestToRest(rate=rate, ramp_time=ramp_time, pause=0.5)
    runs = (limits.duration + once.pause) / (once.duration(shape) + once.pause)
    return RestToRest(rate=rate, ramp_time=ramp_time, pause=0.5, runs=max(1, int(runs)))


def driven(trajectory: Trajectory, climber: Climber) -> tuple[RecordedMotion, Array]:
    """Motion along a trajectory, and the torques (n, 2) [N m] that (11) and (15) ask for."""
    time = np.arange(0.0, trajectory.duration, PERIOD)
    reference = trajectory.at(time)
    heading, speed = np.unwrap(reference.heading), reference.speed
    resisted = climber.seal_friction * sign(speed) + climber.weight_along_wall * sin(heading)
    force = climber.driven_mass * reference.forward_acceleration + resisted
    torques = climber.wheel_torques(
        force, climber.driven_inertia * unpack(reference.acceleration)[2]
    )
    motion = RecordedMotion(
        time=time,
        pose=np.column_stack([reference.pose[:, :2], heading]),
        rates=np.column_stack([speed, reference.yaw_rate]),
        impulse=integral(torques, time),
        pressure=np.full(len(time), climber.suction_pressure),
        stretch=np.zeros(len(time), int),
    )
    return motion, torques
