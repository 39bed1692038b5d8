"""What motor boards that take speeds are given: speeds whose servo gives the accelerations wanted.

    v̇ = (v* - v) / T + r_F / m     =>     v* = v + T (v̇ - r_F / m)        and ω* in the same way

A speed servo of time constant T makes up for weight and friction by itself. Acceleration that did
not come, which the observer puts down to a force r_F, is then that of the servo. Beside torques
that act, the speeds are those to which they are to lead, and r_F is in the torques already.
"""

from climber_uk.control.control_law import Command
from climber_uk.control.model import SLOW
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import ReferencePoint, Speeds, Wrench
from climber_uk.parameters.declaration import parameter, parameters

STANDING = Speeds(0.0, 0.0)


@parameters(slots=True)
class MotorBoard:
    """What drives the wheels: torques, or speeds."""

    motors: str = parameter(
        "torque",
        "",
        "what of `wheel_torques` the driver obeys, effort or velocity",
        choices=("torque", "velocity"),
        runtime=True,
    )
    servo_time_constant: float = parameter(
        0.02,
        "s",
        "T in which a speed servo has done 63 % of a step; too short: it lags",
        at_least=0,
        runtime=True,
        plausible=(0, 0.5),
    )

    def speeds(self, climber: Climber, command: Command, disturbance: Wrench) -> Speeds:
        """v* [m/s] and ω* [rad/s] to a command; `disturbance` is all that is learnt, friction too.

        They take effect in the middle of the command's period, as its `motion` does.
        """
        mass, inertia, _, _ = climber.inertial
        force, (_, moment) = -command.lost.force, command.demanded
        moment = moment - command.lost.moment
        if self.motors == "velocity":
            force = force - disturbance.force
        else:
            moment = moment + disturbance.moment
        T, (*_, v, omega) = self.servo_time_constant, command.motion
        return Speeds(v + T * (command.forward + force / mass), omega + T * moment / inertia)

    def teaches(self, climber: Climber, target: ReferencePoint) -> bool:
        """Whether what comes out other than asked for is to be learnt, on the way to `target`.

        Not where that stands: a servo with a dead band would hunt.
        """
        if self.motors == "torque":
            return True
        return max(abs(target.speed), climber.half_track * abs(target.yaw_rate)) > SLOW
