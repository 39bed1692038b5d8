"""What two odometry messages in a row tell, and the torques that acted between them."""

from typing import NamedTuple

from climber_uk.mechanics.quantities import Motion, Torques, Wrench

Acting = list[tuple[Torques, float]]  # torques, and how long each acts [s]


class Observed(NamedTuple):
    """Two odometry messages in a row, and what acted between them."""

    before: Motion  # as estimated
    after: Motion  # as measured
    time: float  # [s] between them
    acted: Acting  # torques, and how long each [s]
    disturbance: Wrench  # as it was known before
    reaction: float  # [s] in which a torque can answer
    pull: float = 0.0  # [N] forwards, of the weight beyond that on a plane: see `weight_beyond`
    turning: float = 0.0  # [rad/s] that was wanted last
    late: float = 0.0  # [s] by which torques act later than is known, and will be

    @property
    def torques(self) -> Torques:
        """Mean of the torques that acted."""
        whole = right = left = 0.0
        for torques, time in self.acted:
            whole += time
            right += torques.right * time
            left += torques.left * time
        whole = whole or 1.0
        return Torques(right / whole, left / whole)
