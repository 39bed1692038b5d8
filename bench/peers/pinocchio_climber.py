"""The climber in Pinocchio: a planar joint, its velocity (v, 0, ω) in the climber's frame.

Inverse dynamics of (v̇, 0, θ̈) are then drive force, lateral reaction and moment at once.
"""

from functools import cached_property
from typing import Any

import numpy as np
import pinocchio
from peers.inverse_dynamics import ByInverseDynamics

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion


def model(climber: Climber) -> Any:
    """Mass and inertia on a planar joint, and the weight along the wall."""
    built, here = pinocchio.Model(), pinocchio.SE3.Identity()
    built.gravity.linear = np.array([0.0, -climber.weight_along_wall / climber.mass, 0.0])
    joint = built.addJoint(0, pinocchio.JointModelPlanar(), here, "climber")
    rotational = np.diag([climber.yaw_inertia] * 3)
    built.appendBodyToJoint(joint, pinocchio.Inertia(climber.mass, np.zeros(3), rotational), here)
    return built


class WithPinocchio(ByInverseDynamics):
    """By the recursive Newton-Euler algorithm."""

    @cached_property
    def model(self) -> Any:
        """See `model`."""
        return model(self.climber)

    @cached_property
    def data(self) -> Any:
        """What Pinocchio computes in."""
        return self.model.createData()

    def needed(self, v_1: float, theta_2: float, motion: Motion) -> tuple[float, float, float]:
        """See `ByInverseDynamics`."""
        q = np.array([motion.x, motion.y, motion.cosine, motion.sine])
        v = np.array([motion.speed, 0.0, motion.yaw_rate])
        rates = np.array([v_1, 0.0, theta_2])
        drive, lateral, turn = pinocchio.rnea(self.model, self.data, q, v, rates).tolist()
        return drive, lateral, turn


class WithPinocchioMatrices(WithPinocchio):
    """By M and the nonlinear effects h: M v̇ + h."""

    def needed(self, v_1: float, theta_2: float, motion: Motion) -> tuple[float, float, float]:
        """See `ByInverseDynamics`."""
        q = np.array([motion.x, motion.y, motion.cosine, motion.sine])
        v = np.array([motion.speed, 0.0, motion.yaw_rate])
        M = pinocchio.crba(self.model, self.data, q)
        h = pinocchio.nonLinearEffects(self.model, self.data, q, v)
        drive, lateral, turn = (M @ np.array([v_1, 0.0, theta_2]) + h).tolist()
        return drive, lateral, turn
