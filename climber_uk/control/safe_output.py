"""The safe output: no torque, or brake while carrying the weight, as `Safety` says."""

from climber_uk.control.control_law import Braking, ControlLaw, check_finite
from climber_uk.control.estimator import Estimator, Observed
from climber_uk.control.polarity import Polarities
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.timing import LONGEST_STEP
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import NO_TORQUES, Motion, Torques

BRAKING = 0.01  # [s] after which the safe output has to have braked what moves
PUSHED = 0.05  # [m/s] by which it may be faster than before; if it is, something pushes it:
COASTING = 0.3  # [s] for which it is left alone then, as that may be the safe output itself
# what moves, but in doubt and with a polarity that nobody knows, is shaken a little to find it out
SHAKEN = 0.02  # [m/s] of a rim, above which it is
SHAKING = 0.3  # [m/s²] to and fro: 1.5 cm/s
HALF_SHAKE = SECOND // 10  # [ns]
SHAKES = 2 * SECOND  # [ns] of it, at most


class SafeOutput:
    """Torques for the last odometry while nothing is followed."""

    def __init__(self, safety: Safety) -> None:
        self.safety, self.polarities = safety, Polarities()
        self.forget()

    def forget(self) -> None:
        """Forget since when it brakes, or coasts."""
        self.end()
        self._coasts_until = 0  # [ns]

    def end(self) -> None:
        """Something is followed again."""
        self._braked: tuple[int, float] | None = None  # [ns] begin of the safe output, rim speed
        self._doubted: int | None = None  # [ns] since when speeds are in doubt

    def watch(self, climber: Climber, observed: Observed | None) -> None:
        """Take what an odometry tells, for modes that doubt it; None: it is another climber's."""
        if observed is None:
            self.polarities.restart()
        else:
            self.polarities.add(climber, observed)

    def send(
        self, mode: Mode, stamp: int, age: float, estimator: Estimator, law: ControlLaw
    ) -> Torques:
        """Torques in a mode, for the odometry of `stamp` [ns], of `age` [s]; they count as sent."""
        motion, climber, safety = estimator.motion, law.climber, self.safety
        if motion is None or safety.safe_output != "hold" or stamp < self._coasts_until:
            return _let_go(estimator, age)
        rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
        begin, before = self._braked = self._braked or (stamp, rim)
        if stamp - begin > BRAKING * SECOND and rim > before + PUSHED:
            self._coasts_until, self._braked = stamp + round(COASTING * SECOND), None
            return _let_go(estimator, age)
        try:
            if not mode.doubts_odometry:
                self._doubted = None
            elif self._doubted is None:
                self._doubted = stamp
                self.polarities.forget_unknown()
            since = None if self._doubted is None else stamp - self._doubted
            return _brake(estimator, law, age, self._braking(mode, climber, motion, since))
        except (ValueError, ArithmeticError):
            estimator.reset()  # finite odometry gave an absurd state
        return _let_go(estimator, age)

    def _braking(
        self, mode: Mode, climber: Climber, motion: Motion, doubted: int | None
    ) -> Braking:
        """How to brake; `doubted` is for how long [ns] speeds are in doubt, None: they are not."""
        rate, signs = self.safety.braking_rate, self.polarities.signs
        if doubted is None:
            drive, yaw = (rate * (sign or 1) for sign in signs)
            # the other wheel can brake a turn, while the seal holds what it drives
            one = mode is Mode.DEAD_WHEEL and climber.seal_friction >= climber.weight_along_wall
            return Braking(0.0, yaw, carries=False) if one else Braking(drive, yaw)
        rims = motion.speed, climber.half_track * motion.yaw_rate
        drive, yaw = (
            0.0 if sign or abs(rim) < SHAKEN else _shaking(doubted)
            for sign, rim in zip(signs, rims, strict=True)
        )
        return Braking(rate * signs[0], rate * signs[1], shaking=(drive, yaw))


def _shaking(doubted: int) -> float:
    """Acceleration [m/s²] that shakes what has been in doubt for so long [ns]."""
    if doubted >= SHAKES:
        return 0.0
    return SHAKING if (doubted + HALF_SHAKE // 2) // HALF_SHAKE % 2 == 0 else -SHAKING


def _let_go(estimator: Estimator, age: float) -> Torques:
    estimator.sent(estimator.begin(age), NO_TORQUES)
    return NO_TORQUES


def _brake(estimator: Estimator, law: ControlLaw, age: float, braking: Braking) -> Torques:
    """Torques that carry the weight and brake; raises `ValueError` if they are not finite."""
    ahead = estimator.ahead(age)
    if age >= LONGEST_STEP:  # it has been braked, as far as can be known
        at_rest = ahead.motion._replace(speed=0.0, yaw_rate=0.0)
        ahead = ahead._replace(motion=at_rest)
    torques = law.braking(ahead, braking)
    check_finite(torques)
    estimator.sent(ahead.begins, torques)
    return torques
