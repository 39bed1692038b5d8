"""The controller's law with the force on the climber from someone else's inverse dynamics."""

from typing import Any

from climber_uk.control.control_law import ControlLaw
from climber_uk.mechanics.elementary import tanh
from climber_uk.mechanics.quantities import Motion


class ByInverseDynamics(ControlLaw):
    """The same law; the friction of the seal, which no model of rigid bodies has, is added."""

    def needed(self, v_1: float, theta_2: float, motion: Motion) -> tuple[float, float, float]:
        """What gives v̇ and θ̈ without friction: forward [N], to the left [N], about z [N m]."""
        raise NotImplementedError

    def closed_form(
        self, prepared: Any, motion: Motion, friction: Any = 0.0, *_: Any
    ) -> tuple[Any, Any, Any]:
        """See `ControlLaw`."""
        v_1, theta_2, speed, yaw_rate = self.constraints.desired_acceleration(prepared, motion)
        drive, _, turn = self.needed(v_1, theta_2, motion)
        rubbing = (self.climber.seal_friction + friction) * tanh(
            speed / self.options.friction_speed
        )
        return drive + rubbing, turn, v_1, yaw_rate
