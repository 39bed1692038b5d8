"""Runs of which the truth is known, to try the identification on: lock-step, without messages."""

from dataclasses import dataclass, field, replace

import numpy as np

from climber_uk.closed_loop.simulate import Controlling, Link, Run, simulate
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.controller import Answer, Controller, Settings
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.control.timing import Timing
from climber_uk.identification.estimation import CUT, identify
from climber_uk.identification.identified import NAMES, Choice, Identified
from climber_uk.identification.integral_equations import Cut
from climber_uk.identification.recorded_motion import RecordedMotion, impulse
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, Tracked
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.mechanics.shapes import Ellipse, Lemniscate
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors

NOISE = Link(
    sensors=Sensors(position_noise=1e-3, heading_noise=1e-3, speed_noise=1e-2, yaw_rate_noise=1e-2)
)
EXACT = Link()
OFF = ("mass", "yaw_inertia", "seal_friction_coefficient")


@dataclass(frozen=True)
class Scenario:
    """What a parameter file says."""

    believed: Climber  # by the controller
    guidance: Guidance
    trajectory: Trajectory
    start: State
    duration: float  # [s]
    contact: Contact = field(default_factory=Contact)
    slip: bool = False
    period: float = 0.005  # [s] from one odometry to the next; of the plant half as much
    observer: Observer = field(default_factory=Observer)

    def plant(self, true: Climber, step: float) -> Plant:
        """What is driven."""
        return Plant(true, step, self.contact, slip=self.slip)

    def run(self, believed: Climber, true: Climber, link: Link, seed: int = 0) -> tuple[Run, "Ear"]:
        """Run of a controller that believes in a climber, and what it was told."""
        law = ControlLaw(believed, self.guidance)
        timing = Timing(control_period=self.period)
        ear = Ear(Controller(Settings(law, self.observer, timing)))
        link = replace(link, step=self.period / 2, period=self.period)
        loop = self.trajectory, self.start, self.duration, ear, true, link
        return simulate(*loop, seed=seed, plant_of=self.plant), ear

    def tracks(self, believed: Climber, true: Climber) -> float:
        """RMS distance from the reference, with exact odometry [m]."""
        run, _ = self.run(believed, true, EXACT)
        return run.rms()


BUILT = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
SLOW = Guidance(frequency=11.0, cross_track_gain=12.0, fade_speed=0.1)
SCENARIOS = {
    "climber.yaml": Scenario(
        BUILT,
        SLOW,
        Trajectory(Lemniscate(1.5, 0.75), RestToRest(rate=0.12), origin=(0.0, 3.0)),
        State(np.array([0.0, 3.0, np.pi / 4]), np.zeros(3)),
        57.0,
    ),
    "paper.yaml": Scenario(
        Climber(),
        Guidance(),
        Trajectory(Ellipse(), ConstantRate()),
        State(np.array([0.0, 6.0, 0.0]), np.array([10.0, 0.0, -0.6])),
        20.0,
        observer=Observer(bandwidth=17.0),
    ),
    # 34 N m of what resists turning, on a small eight, so that a hundred seeds do not take hours
    "four wheels": Scenario(
        BUILT,
        SLOW,
        Trajectory(Lemniscate(0.4, 0.2), RestToRest(rate=0.5), origin=(0.0, 3.0)),
        State(np.array([0.0, 3.0, np.pi / 4]), np.zeros(3)),
        16.0,
        Contact(locomotion=Tracked(scrub_friction_coefficient=0.8, length=0.44)),
        period=0.01,
    ),
}


@dataclass
class Ear:
    """A controller, and all that it is told and answers."""

    controlling: Controlling
    stamps: list[int] = field(default_factory=list)  # [ns]
    motions: list[Motion] = field(default_factory=list)
    torques: list[Array] = field(default_factory=list)

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """See `Controlling`."""
        return self.controlling.on_reference(now, preview)

    def on_odometry(self, now: int, stamp: int, motion: Motion) -> Answer | None:
        """See `Controlling`."""
        answer = self.controlling.on_odometry(now, stamp, motion)
        self.stamps.append(stamp)
        self.motions.append(motion)
        self.torques.append(np.zeros(2) if answer is None else answer.torques)
        return answer

    def motion(self, pressure: float) -> RecordedMotion:
        """What a bag would tell of it; `pressure` [Pa]."""
        time = np.array(self.stamps) / SECOND
        poses = np.array([motion[:3] for motion in self.motions])
        rates = [[motion.speed, motion.yaw_rate] for motion in self.motions]
        return RecordedMotion(
            time=time,
            pose=np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])]),
            rates=np.array(rates),
            impulse=impulse(time, time, np.array(self.torques)),
            pressure=np.full(len(time), pressure),
            stretch=np.zeros(len(time), np.intp),
        )


def truth(believed: Climber, seed: int) -> Climber:
    """Climber of which mass, inertia and friction are each 30 % more or less than believed."""
    shares = 1 + 0.3 * np.random.default_rng(1000 + seed).choice([-1, 1], len(OFF))
    values = {
        name: share * getattr(believed, name) for name, share in zip(OFF, shares, strict=True)
    }
    return replace(believed, **values)


def identified(scenario: Scenario, seed: int, cut: Cut = CUT) -> tuple[Climber, Identified]:
    """The true climber of a seed, and what noisy odometry of its run tells."""
    true = truth(scenario.believed, seed)
    _, ear = scenario.run(scenario.believed, true, NOISE, seed)
    return true, identify(ear.motion(true.suction_pressure), scenario.believed, cut)


def as_identified(believed: Climber, found: Identified) -> Climber:
    """Climber with what was told."""
    return replace(believed, **{name: found[name] for name in OFF if name not in found.reasons})


def errors(true: Climber, found: Identified) -> tuple[Array, Choice]:
    """Relative errors (3,) of `OFF`, nan where it is not told, and whether it is (3,).

    That is, whether the truth is in the interval, or nothing is told.
    """
    indices = [NAMES.index(name) for name in OFF]
    right = np.array([getattr(true, name) for name in OFF])
    off = np.where(found.known[indices], found.values[indices] - right, np.nan)
    outside = np.abs(off) > found.half_widths[indices]
    return off / right, ~outside


def scrub_error(scenario: Scenario, true: Climber, found: Identified) -> tuple[float, bool]:
    """The same of what resists turning."""
    load = scenario.contact.wheel_load(true, true.gravity_into_wall)
    off = found["turning_friction"] - float(scenario.contact.locomotion.turning_resistance(load))
    is_told = "turning_friction" not in found.reasons
    right = not is_told or abs(off) <= found.half_width("turning_friction")
    return off if is_told else float("nan"), right
