"""Other controllers for the same climber, as the field does it, to be measured beside ours.

Each is asked for a force and a moment in the constraints' place (`ForceLaw`): the prediction, the
limits, time scaling and, where it has no integral of its own, the observer are ours.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import solve_continuous_are

from climber_uk.control.control_law import Command, ForceLaw
from climber_uk.control.controller import Controller
from climber_uk.control.guidance import HEADING_SHARE, Guidance
from climber_uk.control.model import DisturbanceEstimate
from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import arctan, cos, sin, tanh, with_sign_of, wrapped
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Wrench

FRICTION_SPEED = 1e-3  # [m/s] of a wanted speed below which friction's share fades
FADE_SPEED = 0.1  # [m/s] of the reference below which steering fades


def tracking_errors(target: ReferencePoint, motion: Motion) -> Array:
    """e_x, e_y [m] in the reference's frame, Δ [rad], and speed [m/s] and yaw rate [rad/s] off."""
    cosine, sine = cos(target.heading), sin(target.heading)
    x, y = motion.x - target.x, motion.y - target.y
    e_x, e_y = x * cosine + y * sine, y * cosine - x * sine
    turned = wrapped(motion.heading - target.heading)
    return np.array(
        [e_x, e_y, turned, motion.speed - target.speed, motion.yaw_rate - target.yaw_rate]
    )


def acceleration(target: ReferencePoint) -> float:
    """Of the reference along its heading [m/s²]."""
    return float(target.a_x * cos(target.heading) + target.a_y * sin(target.heading))


def inverse_dynamics(
    climber: Climber, motion: Motion, forward: float, yaw: float, wanted: float
) -> Wrench:
    """Force and moment for accelerations [m/s², rad/s²], with friction of the `wanted` speed."""
    mass, inertia, friction, weight = climber.inertial
    rubbing = friction * tanh(wanted / FRICTION_SPEED)
    return Wrench(mass * forward + rubbing + weight * motion.sine, inertia * yaw)


@dataclass(frozen=True)
class Weights:
    """Of the errors' squares, beside 1 of both accelerations' from the reference's."""

    along: float
    across: float
    heading: float
    speed: float
    yaw_rate: float

    @property
    def diagonal(self) -> Array:
        """In the order of `tracking_errors`."""
        return np.array([self.along, self.across, self.heading, self.speed, self.yaw_rate])


@lru_cache(maxsize=100_000)
def riccati(weights: Weights, speed: float, yaw_rate: float) -> tuple[Array, Array]:
    """Gains K (2, 5) and cost to go P (5, 5) of the errors about a steady turn."""
    A, B = np.zeros((5, 5)), np.zeros((5, 2))
    A[0, 1], A[0, 3] = yaw_rate, 1.0
    A[1, 0], A[1, 2], A[2, 4] = -yaw_rate, speed, 1.0
    B[3, 0] = B[4, 1] = 1.0
    P = solve_continuous_are(A, B, np.diag(weights.diagonal), np.eye(2))
    return B.T @ P, P


def about(weights: Weights, target: ReferencePoint) -> tuple[Array, Array]:
    """See `riccati`; in steps of a tenth of the speed and of 0.2 rad/s.

    e_y cannot be led back at rest: gains are those of `FADE_SPEED` there, and what steers fades.
    """
    moving = np.hypot(target.speed, FADE_SPEED)
    step = with_sign_of(np.exp(round(10 * np.log(moving)) / 10), target.speed)
    K, P = riccati(weights, float(step), round(5 * target.yaw_rate) / 5)
    return K * [1.0, abs(target.speed) / moving, 1.0, 1.0, 1.0], P


@dataclass(frozen=True)
class LQR(ForceLaw):
    """u = u_d - K e, with the gains of the reference's speed and yaw rate."""

    weights: Weights

    def wrench(self, climber: Climber, target: ReferencePoint, motion: Motion) -> Wrench:
        """See `ForceLaw`."""
        K, _ = about(self.weights, target)
        e = tracking_errors(target, motion)
        forward, yaw = (K @ e).tolist()
        wanted = target.speed - float(K[0, 0] * e[0] / K[0, 3])
        u = acceleration(target) - forward, target.yaw_acceleration - yaw
        return inverse_dynamics(climber, motion, *u, wanted)


@dataclass(frozen=True)
class Kanayama(ForceLaw):
    """Kanayama et al. (1990): v = v_r cosθ_e + K_x x_e, ω = ω_r + v_r (K_y y_e + K_θ sinθ_e).

    Errors are reference minus climber, in the climber's frame. That these speeds are kept is left
    to a computed torque (Fierro & Lewis 1997), here with a PI loop of v and of ω; its integral is
    in an `Integrating` controller.
    """

    along: float  # K_x [1/s]
    across: float  # K_y [1/m²]
    heading: float  # K_θ [1/m]
    drive: float  # [1/s]
    drive_integral: float  # [1/s²]
    turn: float  # [1/s]
    turn_integral: float  # [1/s²]

    def wanted(self, target: ReferencePoint, motion: Motion) -> tuple[Array, Array]:
        """v and ω, and their rates."""
        v_r, a_r, omega_r = target.speed, acceleration(target), target.yaw_rate
        x, y = target.x - motion.x, target.y - motion.y
        x_e, y_e = x * motion.cosine + y * motion.sine, y * motion.cosine - x * motion.sine
        turned = wrapped(target.heading - motion.heading)
        cosine, sine = cos(turned), sin(turned)
        x_e1 = motion.yaw_rate * y_e - motion.speed + v_r * cosine
        y_e1, turned_1 = v_r * sine - motion.yaw_rate * x_e, omega_r - motion.yaw_rate
        steer = self.across * y_e + self.heading * sine
        steer_1 = self.across * y_e1 + self.heading * cosine * turned_1
        v, omega = v_r * cosine + self.along * x_e, omega_r + v_r * steer
        v_1 = a_r * cosine - v_r * sine * turned_1 + self.along * x_e1
        omega_1 = target.yaw_acceleration + a_r * steer + v_r * steer_1
        return np.array([v, omega]), np.array([v_1, omega_1])

    def missing(self, target: ReferencePoint, motion: Motion) -> Array:
        """By how much speed and yaw rate (2,) are too low."""
        return self.wanted(target, motion)[0] - [motion.speed, motion.yaw_rate]

    def fed_back(self, missing: Array) -> Array:
        """Accelerations (2,) of what is missing."""
        return missing * [self.drive, self.turn]

    def integrand(self, missing: Array) -> Array:
        """Rates (2,) of the integrals, which are accelerations."""
        return missing * [self.drive_integral, self.turn_integral]

    def wrench(self, climber: Climber, target: ReferencePoint, motion: Motion) -> Wrench:
        """See `ForceLaw`; without the integral."""
        wanted, rates = self.wanted(target, motion)
        u = rates + self.fed_back(wanted - [motion.speed, motion.yaw_rate])
        return inverse_dynamics(climber, motion, *u.tolist(), float(wanted[0]))


class SuperTwisting(Kanayama):
    """The same speeds, kept by the super-twisting algorithm (Levant 1993).

    u = k_1 |s|^½ sign s + z, ż = k_2 sign s, with s what is missing of v and of ω.
    """

    def fed_back(self, missing: Array) -> Array:
        """See `Kanayama`."""
        return super().fed_back(np.sqrt(np.abs(missing)) * np.sign(missing))

    def integrand(self, missing: Array) -> Array:
        """See `Kanayama`."""
        return super().integrand(np.sign(missing))


class Learning(Controller):
    """A controller that learns in a way of its own, in the observer's place."""

    def _follow(self, age: float) -> tuple[Mode, str, Command | None]:
        """Torques for the last odometry, once that has been learnt from."""
        estimator = self.estimator
        target, motion = self.active.at(estimator.stamp), estimator.motion
        if target is not None and motion is not None:
            force, moment = self.learn(target, motion)
            estimator.learnt = DisturbanceEstimate(force, moment)
        return super()._follow(age)

    def learn(self, target: ReferencePoint, motion: Motion) -> tuple[float, float]:
        """Force [N] and moment [N m] of the disturbance, as of now."""
        raise NotImplementedError


class Integrating(Learning):
    """Has the integral of a `Kanayama`, which rests while a limit cuts the torque."""

    integral: Array = np.zeros(2)

    def learn(self, target: ReferencePoint, motion: Motion) -> tuple[float, float]:
        """See `Learning`."""
        law, climber, answer = self.law.other, self.law.climber, self.answer
        assert isinstance(law, Kanayama)
        if answer is not None and answer.command is not None and answer.command.fits:
            missing = law.missing(target, motion)
            self.integral = self.integral + self.estimator.period * law.integrand(missing)
        drive, turn = self.integral.tolist()
        return -climber.mass * drive, -climber.yaw_inertia * turn


@dataclass(frozen=True)
class AdaptiveGains:
    """Of one direction of the adaptive robust control: drive, or turn."""

    growth: float  # k_1
    leakage: float  # k_2 [1/s]
    layer: float  # ε


class AdaptiveRobust(Learning):
    """Adaptive robust UK control with leakage in the observer's place.

    As Udwadia, Wanichanon & Cho (2014) and Zhen, Chen et al. do: the nominal UK force, and against
    what is unknown p = -γ μ a with μ = β a and γ = 1/|μ| outside of a layer |μ| > ε, 1/ε inside;
    the bound grows and leaks, ȧ = k_1 |β| - k_2 a. β is how far the constraints are from being
    met: of the speed, and of the heading with its rate.
    """

    # found by `tune.py adaptive`
    gains = AdaptiveGains(6_300.0, 1.10, 5.87), AdaptiveGains(365.0, 5.14, 1.01)

    bounds: Array = np.zeros(2)

    def learn(self, target: ReferencePoint, motion: Motion) -> tuple[float, float]:
        """See `Learning`."""
        learnt = []
        errors = constraint_errors(self.law.constraints, target, motion)
        self.bounds = self.bounds.copy()
        for i, (gains, beta) in enumerate(zip(self.gains, errors, strict=True)):
            bound = float(self.bounds[i])
            mu = beta * bound
            learnt.append(mu * bound / max(abs(mu), gains.layer))
            growth = gains.growth * abs(beta) - gains.leakage * bound
            self.bounds[i] = max(bound + self.estimator.period * growth, 0.0)
        drive, turn = learnt
        return drive, turn


def constraint_errors(
    gains: Guidance, target: ReferencePoint, motion: Motion
) -> tuple[float, float]:
    """How far speed [m/s] and heading rate [rad/s] are from what guidance wants, at this moment."""
    e_x, e_y, turned, _, turning = tracking_errors(target, motion).tolist()
    g = gains.steering(target.speed)
    w = g * e_y
    w_1 = g * (motion.speed * sin(turned) - target.yaw_rate * e_x)
    rate = HEADING_SHARE * gains.frequency / (2 * gains.damping)
    heading = turning + w_1 / (1 + w**2) + rate * (turned + arctan(w))
    _, _, wanted, _ = gains.desired_acceleration(gains.prepare(target), motion)
    return motion.speed - float(wanted), float(heading)
