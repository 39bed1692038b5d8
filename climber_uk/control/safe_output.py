"""The safe output: no torque, or brake while carrying the weight, as `Safety` says."""

from climber_uk.control.control_law import ControlLaw, check_finite
from climber_uk.control.estimator import Estimator
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.timing import LONGEST_STEP
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import NO_TORQUES, Torques

BRAKING = 0.01  # [s] after which the safe output has to have braked what moves
PUSHED = 0.05  # [m/s] by which it may be faster than before; if it is, something pushes it:
COASTING = 0.3  # [s] for which it is left alone then, as that may be the safe output itself


class SafeOutput:
    """Torques for the last odometry while nothing is followed."""

    def __init__(self, safety: Safety) -> None:
        self.safety = safety
        self.forget()

    def forget(self) -> None:
        """Forget since when it brakes, or coasts."""
        self.end()
        self._coasts_until = 0  # [ns]

    def end(self) -> None:
        """Something is followed again."""
        self._braked: tuple[int, float] | None = None  # [ns] begin of the safe output, rim speed

    def send(
        self, mode: Mode, stamp: int, age: float, estimator: Estimator, law: ControlLaw
    ) -> Torques:
        """Torques in a mode, for the odometry of `stamp` [ns], of `age` [s]; they count as sent."""
        motion, climber, safety = estimator.motion, law.climber, self.safety
        # one wheel that brakes yaws the climber
        yaws = mode is Mode.DEAD_WHEEL and climber.seal_friction >= climber.weight_along_wall
        if motion is None or yaws or safety.safe_output != "hold" or stamp < self._coasts_until:
            return _let_go(estimator, age)
        rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
        begin, before = self._braked = self._braked or (stamp, rim)
        if stamp - begin > BRAKING * SECOND and rim > before + PUSHED:
            self._coasts_until, self._braked = stamp + round(COASTING * SECOND), None
            return _let_go(estimator, age)
        braking = 0.0 if mode.doubts_odometry else safety.braking_rate
        try:
            return _brake(estimator, law, age, braking)
        except (ValueError, ArithmeticError):
            estimator.reset()  # finite odometry gave an absurd state
        return _let_go(estimator, age)


def _let_go(estimator: Estimator, age: float) -> Torques:
    estimator.sent(estimator.begin(age), NO_TORQUES)
    return NO_TORQUES


def _brake(estimator: Estimator, law: ControlLaw, age: float, braking_rate: float) -> Torques:
    """Torques that carry the weight and brake; raises `ValueError` if they are not finite."""
    ahead = estimator.ahead(age)
    if age >= LONGEST_STEP:  # it has been braked, as far as can be known
        at_rest = ahead.motion._replace(speed=0.0, yaw_rate=0.0)
        ahead = ahead._replace(motion=at_rest)
    torques = law.braking(ahead, braking_rate)
    check_finite(torques)
    estimator.sent(ahead.begins, torques)
    return torques
