"""The climber in MuJoCo: a body on two sliders and a hinge, and no contact.

Torques act through a site that turns with the body. The seal rubs with f against driving forwards:
MuJoCo has friction of joints and tendons, but none of these lies along a body that turns, so that
it can neither stick nor reverse. Nor has MuJoCo nonholonomic constraints. In their place there is
either the lateral reaction as a third input, known beforehand, or a damper against side slip.
"""

from functools import cache, cached_property
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import Rollout
from peers.inverse_dynamics import ByInverseDynamics

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion

FULL_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
SIDEWAYS = {
    "reaction given": '<general site="centre" gear="0 1 0 0 0 0"/>',
    "stiff damper": '<general site="centre" gear="0 1 0 0 0 0" gainprm="0" biastype="affine"'
    ' biasprm="0 0 -1e6"/>',  # [N s/m]
}
XML = """
<mujoco>
  <option timestep="{step}" gravity="0 {gravity} 0" integrator="{integrator}">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body>
      <joint type="slide" axis="1 0 0"/>
      <joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
      <site name="centre"/>
    </body>
  </worldbody>
  <actuator>
    <general site="centre" gear="{drive} 0 0 0 0 {turn}"/>
    <general site="centre" gear="{drive} 0 0 0 0 -{turn}"/>
    {sideways}
    <general site="centre" gear="1 0 0 0 0 0" biastype="affine" biasprm="-{friction} 0 0"/>
  </actuator>
</mujoco>
"""


@cache
def model(climber: Climber, sideways: str, integrator: str, step: float) -> Any:
    """Model with the inputs τR, τL and the lateral reaction, and one that stays 0."""
    return mujoco.MjModel.from_xml_string(
        XML.format(
            step=step,
            gravity=-climber.weight_along_wall / climber.mass,
            integrator=integrator,
            mass=climber.mass,
            inertia=climber.yaw_inertia,
            drive=1 / climber.wheel_radius,
            turn=climber.half_track / climber.wheel_radius,
            friction=climber.seal_friction,
            sideways=SIDEWAYS[sideways],
        )
    )


def rolled_out(built: Any, starts: Array, inputs: Array, threads: int) -> Array:
    """Poses and velocities (N, steps, 6), of starts (N, 6) and inputs (steps, 3), by `rollout`."""
    states = np.zeros((len(starts), mujoco.mj_stateSize(built, FULL_STATE)))
    states[:, 1:7] = starts
    control = np.pad(inputs, ((0, 0), (0, built.nu - inputs.shape[1])))
    with Rollout(nthread=threads if threads > 1 else 0) as rollout:
        data = [mujoco.MjData(built) for _ in range(threads)]
        states, _ = rollout.rollout(built, data, states, control[None])
    return states[..., 1:7]


class WithMuJoCo(ByInverseDynamics):
    """By MuJoCo's inverse dynamics, in which actuators have no part."""

    @cached_property
    def model(self) -> Any:
        """Of which neither the inputs nor the step matter here."""
        return model(self.climber, "reaction given", "Euler", step=0.0025)

    @cached_property
    def data(self) -> Any:
        """What MuJoCo computes in."""
        return mujoco.MjData(self.model)

    def needed(self, v_1: float, theta_2: float, motion: Motion) -> tuple[float, float, float]:
        """See `ByInverseDynamics`."""
        x, y, heading, cosine, sine, v, omega = motion
        sideways, data = v * omega, self.data
        data.qpos[:] = x, y, heading
        data.qvel[:] = v * cosine, v * sine, omega
        data.qacc[:] = (
            v_1 * cosine - sideways * sine,
            v_1 * sine + sideways * cosine,
            theta_2,
        )
        mujoco.mj_inverse(self.model, data)
        f_x, f_y, turn = data.qfrc_inverse.tolist()
        return f_x * cosine + f_y * sine, f_y * cosine - f_x * sine, turn
