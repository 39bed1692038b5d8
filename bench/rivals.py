"""Other controllers for the same climber, as the field does it, to be measured beside ours."""

from dataclasses import dataclass

import numpy as np

from climber_uk.closed_loop.simulate import Link
from climber_uk.control.constraint_set import demanded
from climber_uk.control.control_law import Command
from climber_uk.control.controller import Answer, Controller
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import DisturbanceEstimate
from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import arctan, cos, sin
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, State, Torques
from climber_uk.mechanics.reference import Reference, tracking_error

IDEAL = Link()


@dataclass(frozen=True)
class KanayamaGains:
    """Of the kinematic law, and of the wheels' PI loops."""

    along: float  # K_x [1/s]
    across: float  # K_y [1/m²]
    heading: float  # K_θ [1/m]
    proportional: float  # [N m s]
    integral: float  # [N m]


class Kanayama:
    """Kanayama et al. (1990): v = v_r cosθ_e + K_x x_e, ω = ω_r + v_r (K_y y_e + K_θ sinθ_e).

    Errors are reference minus climber, in the climber's frame. A PI loop makes each wheel turn as
    v and ω ask, on the motors' board: at every step of the plant, from the wheel's true rate, and
    without integrating while it saturates. No model of the climber is used.
    """

    def __init__(self, climber: Climber, gains: KanayamaGains) -> None:
        self.climber, self.gains = climber, gains
        self.preview: Preview | None = None
        self.integral: Array = np.zeros(2)  # [rad] of both wheels

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Keep a reference."""
        self.preview = preview
        return None

    def on_odometry(self, now: int, stamp: int, motion: Motion) -> Answer | None:
        """Answer an odometry."""
        reference = self.preview.at(stamp) if self.preview else None
        if reference is None:
            return None
        gains, cosine, sine = self.gains, motion.cosine, motion.sine
        x, y, turned = (reference.pose - [motion.x, motion.y, motion.heading]).tolist()
        ahead, beside = x * cosine + y * sine, y * cosine - x * sine
        v = float(reference.speed) * cos(turned) + gains.along * ahead
        steer = gains.across * beside + gains.heading * sin(turned)
        wanted = motion._replace(
            speed=v, yaw_rate=float(reference.yaw_rate + reference.speed * steer)
        )
        return Answer(stamp, Torques(*self.climber.rim_rates(wanted)), None)

    def motors(self, state: State, rates: Array) -> Array:
        """Torques (2,) of the wheels' PI loops on their way to `rates` (2,) [rad/s]."""
        error = rates - self.climber.wheel_rates(state)
        torques = self.gains.proportional * error + self.gains.integral * self.integral
        inside = np.abs(torques) < self.climber.max_wheel_torque
        self.integral = self.integral + error * IDEAL.step * inside
        return torques


@dataclass(frozen=True)
class AdaptiveGains:
    """Of one direction of the adaptive robust control: drive, or turn."""

    growth: float  # k_1
    leakage: float  # k_2 [1/s]
    layer: float  # ε


class AdaptiveRobust(Controller):
    """Adaptive robust UK control with leakage in the observer's place.

    As Udwadia, Wanichanon & Cho (2014) and Zhen, Chen et al. do: the nominal UK force, and against
    what is unknown p = -γ μ a with μ = β a and γ = 1/|μ| outside of a layer |μ| > ε, 1/ε inside;
    the bound grows and leaks, ȧ = k_1 |β| - k_2 a. β is how far the constraints are from being
    met: of the speed, and of the heading with its rate.
    """

    # found by `robustness.py --tune adaptive`
    drive_gains = AdaptiveGains(23_200.0, 4.06, 4.57)
    turn_gains = AdaptiveGains(732.0, 3.55, 0.558)

    bounds: Array = np.zeros(2)

    def _follow(self, age: float) -> tuple[Mode, str, Command | None]:
        """Torques for the last odometry, by its own constraints."""
        estimator, active = self.estimator, self.active
        if not any(estimator.disturbance):
            self.bounds = np.zeros(2)  # it starts anew
        preview, motion = active.preview, estimator.motion
        reference = preview.at(active.progress.at(estimator.stamp)) if preview else None
        if reference is not None and motion is not None:
            errors = constraint_errors(self.law.constraints, State.moving(motion), reference)
            forces = []
            for i, gains in enumerate((self.drive_gains, self.turn_gains)):
                beta, bound = errors[i], self.bounds[i]
                mu = beta * bound
                gamma = 1 / max(abs(mu), gains.layer)
                forces.append(-gamma * mu * bound)
                growth = gains.growth * abs(beta) - gains.leakage * bound
                self.bounds[i] = max(bound + estimator.period * growth, 0.0)
            estimator.learnt = DisturbanceEstimate(*(-force for force in forces))
        return super()._follow(age)


def constraint_errors(gains: Guidance, state: State, reference: Reference) -> tuple[float, float]:
    """How far speed [m/s] and heading rate [rad/s] are from what guidance wants, at this moment."""
    e_x, e_y, turned = tracking_error(state.pose, reference)
    v_d = reference.speed
    g = gains.cross_track_gain * v_d / np.hypot(v_d, gains.fade_speed)
    w = g * e_y
    w_1 = g * (state.forward_speed * sin(turned) - reference.yaw_rate * e_x)
    led_1 = state.yaw_rate - reference.yaw_rate + w_1 / (1 + w**2)
    heading = led_1 + gains.heading_frequency * (turned + arctan(w))
    _, _, wanted = demanded(gains, state, reference)
    return float(state.forward_speed - wanted), float(heading)
