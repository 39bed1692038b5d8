"""The safe output: no torque, or brake while carrying the weight, as `Safety` says."""

import math

from climber_uk.control.control_law import Braking, ControlLaw, check_finite
from climber_uk.control.estimator import Estimator
from climber_uk.control.observed import Observed
from climber_uk.control.polarity import Polarities, PoseSpeeds
from climber_uk.control.safety import NO_FAULTS, Mode, Safety
from climber_uk.control.timing import LONGEST_STEP
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import clipped
from climber_uk.mechanics.quantities import NO_TORQUES, NO_WRENCH, Motion, Torques, Wrench

BRAKING = 0.01  # [s] after which the safe output has to have braked what moves
PUSHED = 0.05  # [m/s] by which it may be faster than before, and
DRIVEN = 0.2  # than it was braked to; if it is, something pushes it:
GENTLER, CALM = 0.5, SECOND  # times as fast it is braked after that, for [ns] without another
COASTING = 0.3  # [s] for which it is left alone then, as that may be the safe output itself
NOTHING = 0.05  # of the weight: a drive that is let go
FALLS = 0.1  # [m/s] by which it may get faster without a torque, if its seal holds it
SINKS = 0.3  # [m/s] likewise downwards, in all the times that it is left for longer than
SOON = 0.15  # [s]: late torques of who goes down brake it still
LONGEST_EFFECT = (
    0.6  # [s] that a torque may act after it was sent: none acts this long after the last
)
LESS = 0.5  # times as much of the weight is carried, where what carries it drives it
LEFT_FOR = SECOND // 10  # [ns] for which what is driven against its torques is left to its seal
# what moves, but in doubt and with a polarity that nobody knows, is shaken a little to find it out
SHAKEN = 0.02  # [m/s] of a rim, above which it is
SHAKING = 0.3  # [m/s²] to and fro: 1.5 cm/s
HALF_SHAKE = SECOND // 10  # [ns]
SHAKES = 2 * SECOND  # [ns] of it, at most
REACHES = 0.1  # of the braking rate: that of the integral that carries what pushes it
# modes of a climber with which nothing is wrong: what was learnt as it followed pushes it still
STOPS = Mode.EMERGENCY_STOP, Mode.LOW_BATTERY, Mode.TETHER, Mode.NO_REFERENCE
SOUND = NO_FAULTS.union(STOPS)
TURNED = SOUND | {Mode.TOO_FAST}  # in which something else than a faulty wheel may turn it


class SealCheck:
    """Whether a seal gives way: who is not driven gets faster, once no late torque can act.

    Who goes down gets so by its weight, as well soon after a torque that would have braked it.
    """

    def __init__(self) -> None:
        self.gives_way = False
        self._left_for, self._slowest = 0.0, math.inf  # [s] without a torque, [m/s] since then
        self._last = self._sunk = 0.0  # [m/s], and by how much it got faster downwards

    def add(self, is_driven: bool, speed: float, time: float, *, goes_down: bool) -> None:
        """Take a speed [m/s], after a `time` [s] in which torques drove it or not."""
        self._left_for = 0.0 if is_driven else self._left_for + time
        self._slowest = min(self._slowest, speed) if self._left_for > LONGEST_EFFECT else math.inf
        if self._left_for > SOON:
            self._sunk = max(0.0, self._sunk + speed - self._last) if goes_down else 0.0
        self._last = speed
        self.gives_way = self.gives_way or speed > self._slowest + FALLS or self._sunk > SINKS


class SafeOutput:
    """Torques for the last odometry while nothing is followed."""

    def __init__(self, safety: Safety) -> None:
        self.safety, self.polarities, self.by_pose = safety, Polarities(), PoseSpeeds()
        self._seen: Motion | None = None
        self._is_driven = False  # ever faster against its torques, by more than its weight
        self.forget()

    def forget(self) -> None:
        """Forget since when it brakes, or coasts."""
        self.end()
        self._coasts_until = 0  # [ns]
        self._carries = 1.0  # share of the weight that is believed, less where that lifts it
        self._way = 1  # -1 if the speed was known last to go against its torques

    def end(self) -> None:
        """Something is followed again."""
        # begin of the braking [ns], a rim's speed then, the lowest since; and which way it brakes
        self._braked: tuple[int, float, float, int] | None = None
        self._doubted: int | None = None  # [ns] since when speeds are in doubt
        self._coasts_from = 0.0  # [m/s] of a rim
        self._is_carried = True  # the weight, as it coasts
        self._gently = 1.0  # share of its rate that it brakes with, less each time it is pushed
        self._begins, self._left_until = True, 0  # with the next torques; [ns]
        self._seal = SealCheck()
        # [N] what was learnt to push it as it was followed, and what is carried of that (None: no
        # more than its weight is known); [N m] what turns it; and whether more of both is learnt
        self._learnt = self._turn = 0.0
        self._push: float | None = None
        self._learns = self._learns_turn = False

    def watch(self, climber: Climber, observed: Observed | None, motion: Motion) -> None:
        """Take what an odometry tells, for modes that doubt it; None: it has jumped to `motion`."""
        seen, self._seen = self._seen or motion, motion
        self._is_driven = False
        if observed is not None:
            force, _ = climber.wrench(*observed.torques)
            gained = abs(observed.after.speed) - abs(observed.before.speed)
            is_against = force * observed.after.speed < 0
            self._is_driven = is_against and gained > GRAVITY * observed.time
            if not self._begins:
                is_driven = abs(force) >= NOTHING * climber.mass * GRAVITY
                after, (*_, weight) = observed.after, climber.inertial
                downhill = observed.pull - weight * after.sine  # [N] forwards
                goes_down = downhill * after.speed > 0
                self._seal.add(is_driven, abs(after.speed), observed.time, goes_down=goes_down)
            self.polarities.add(climber, observed)
            self.by_pose.add(climber, observed)
            self._learn_push(climber, observed)
            self._way = self.polarities.drive.sign or self._way
            return
        self.polarities.restart()
        pose = motion._replace(
            speed=seen.speed, yaw_rate=seen.yaw_rate, cosine=seen.cosine, sine=seen.sine
        )
        if self.safety.has_jumped(seen, pose, climber.half_track):
            self.by_pose.restart()

    def _learn_push(self, climber: Climber, observed: Observed) -> None:
        """Learn what pushes it: as it is followed, then, and what turns it, by its speeds yet."""
        if self._begins:
            self._learnt = observed.disturbance.force
            return
        rate = REACHES * self.safety.braking_rate**2 * observed.time
        most = 2 * climber.max_wheel_torque / climber.wheel_radius
        if self.polarities.is_wrong:
            self._push, self._turn, self._learns_turn = None, 0.0, False
            return
        if self._push is not None and self._learns:
            pushed = self._push + rate * climber.driven_mass * observed.after.speed
            self._push = clipped(pushed, -most, most)
        if self._learns_turn:
            turned = self._turn + rate * climber.driven_inertia * observed.after.yaw_rate
            self._turn = clipped(turned, -most * climber.half_track, most * climber.half_track)

    def send(
        self, mode: Mode, stamp: int, age: float, estimator: Estimator, law: ControlLaw
    ) -> Torques:
        """Torques in a mode, for the odometry of `stamp` [ns], of `age` [s]; they count as sent."""
        motion, climber, safety = estimator.motion, law.climber, self.safety
        if motion is None or safety.safe_output != "hold":
            return _let_go(estimator, age)
        falls = self._falls(law)
        if mode is Mode.NO_ODOMETRY and age < safety.odometry_timeout and not falls:
            return self._coast(mode, estimator, law, age)  # it comes again, and may be old
        rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
        if self._begins:
            self._carry_on(mode, falls)
        if self._lets_go(mode, stamp, falls):
            return _let_go(estimator, age)
        # what goes down, not up, where too much is carried, or turns, though its torques are right
        sinks = falls and law.weight(motion) * motion.speed <= 0 and self._answers(mode)
        turns = rim > 2 * max(abs(motion.speed), SHAKEN) and self._is_turned(mode)
        self._learns_turn, answers = self._learns_turn or turns, sinks or turns
        if stamp < self._coasts_until and not answers:
            if rim > self._coasts_from + PUSHED:  # motors that are not as believed, perhaps
                self._is_carried = False
                self._weigh(law, motion)
                self._coasts_from = rim
            return self._coast(mode, estimator, law, age)
        is_pushed = self._is_pushed(stamp, rim, falls)
        if is_pushed and sinks:
            self._push, self._learns = self._push or 0.0, mode not in SOUND
        elif is_pushed and not answers:
            self._coasts_until, self._braked = stamp + round(COASTING * SECOND), None
            self._gently *= GENTLER
            self._coasts_from, self._way = rim, 1  # a push looks like motors the wrong way round
            return self._coast(mode, estimator, law, age)
        try:
            return self._stop(mode, stamp, age, estimator, law)
        except (ValueError, ArithmeticError):
            estimator.reset()  # finite odometry gave an absurd state
        return _let_go(estimator, age)

    def _carry_on(self, mode: Mode, falls: bool) -> None:
        """Carry what was learnt to push it, where that may be believed; not what resisted turns."""
        is_known = falls and (mode in SOUND or self._answers(mode))
        self._push = self._learnt if is_known else None
        self.polarities.forget_wheels()

    def _weigh(self, law: ControlLaw, motion: Motion) -> None:
        """Carry half of the weight if it is driven upwards by that; else twice as much again."""
        weight, climber = law.weight(motion), law.climber
        if weight * motion.speed <= 0:
            self._carries = min(1.0, self._carries / LESS)
            return
        most = 2 * climber.max_wheel_torque / climber.wheel_radius  # more of it has no effect
        self._carries = LESS * min(self._carries, most / abs(weight))

    def _holds(self, law: ControlLaw) -> bool:
        """Whether its seal holds its weight."""
        return not self._falls(law) and law.climber.seal_friction > 0

    def _falls(self, law: ControlLaw) -> bool:
        """Whether its weight may be more than its seal holds, as is believed or has shown."""
        return law.falls or self._seal.gives_way

    def _stop(
        self, mode: Mode, stamp: int, age: float, estimator: Estimator, law: ControlLaw
    ) -> Torques:
        """Torques that brake, by speeds that are believed; raises `ValueError` as `_brake` does."""
        motion = estimator.motion
        assert motion is not None  # it moves
        if not mode.doubts_odometry:
            self._doubted = None
        elif self._doubted is None:
            self._doubted = stamp
            self.polarities.forget_unknown()
        if self._doubted is None:
            push = Wrench(self._push or 0.0, self._turn)
            return _brake(estimator, law, age, self._braking(mode, law), None, push)
        believed, signs = self._believed(mode, motion)
        braking = self._braking_in_doubt(mode, law, believed, signs, stamp - self._doubted)
        return _brake(estimator, law, age, braking, believed)

    def _answers(self, mode: Mode) -> bool:
        """Whether torques surely do what they should, as odometry tells that may be believed."""
        is_doubtful = mode is Mode.LATE or mode.doubts_odometry
        return self.polarities.are_right and not is_doubtful

    def _is_turned(self, mode: Mode) -> bool:
        """Whether a turn that follows its torques, or both wheels do, has another cause."""
        is_right = self.polarities.are_right or self.polarities.yaw.sign > 0
        return is_right and mode in TURNED

    def _is_pushed(self, stamp: int, rim: float, falls: bool) -> bool:
        """Whether a rim's speed [m/s] has grown, though it has been braked for a while.

        Of what `falls`, what brakes may turn round: then it has been driven until now.
        """
        if self._braked is None or (falls and self._braked[3] != self._way):
            self._braked = stamp, rim, rim, self._way
        begin, before, lowest, way = self._braked
        self._braked = begin, before, min(lowest, rim), way
        if stamp - begin > CALM:
            self._gently = 1.0
        is_faster = rim > before + PUSHED or rim > lowest + DRIVEN
        return is_faster and stamp - begin > BRAKING * SECOND

    def _lets_go(self, mode: Mode, stamp: int, falls: bool) -> bool:
        """Whether it leaves what may have motors the wrong way round to its seal for a moment.

        What brakes would drive then, and a seal stops a push as well.
        """
        is_known = self.polarities.drive.sign > 0
        if self._begins and mode is Mode.TOO_FAST and self._is_driven and not is_known:
            self._left_until = stamp + LEFT_FOR
        self._begins = False
        return stamp < self._left_until and not falls

    def _coast(self, mode: Mode, estimator: Estimator, law: ControlLaw, age: float) -> Torques:
        """Torques that brake nothing, and carry the weight: where no seal holds it, or less of it.

        Where odometry is in doubt, its heading may be wrong, and a seal that holds is trusted; so
        it is where the climber goes ever faster that way.
        """
        knows = mode.is_fault and not mode.doubts_odometry and mode is not Mode.NO_ODOMETRY
        way = self._way if knows else 1
        if not self._falls(law) and (mode.doubts_odometry or not self._is_carried or way < 0):
            return _let_go(estimator, age)
        return _brake(estimator, law, age, Braking(0.0, 0.0, way * self._carries), None)

    def _believed(self, mode: Mode, motion: Motion) -> tuple[Motion, tuple[int, int]]:
        """Motion in doubt, with those speeds that follow torques, and their signs.

        They are the twist's, or else the pose's, which come first where there is no twist.
        """
        by_twist = zip((motion.speed, motion.yaw_rate), self.polarities.signs, strict=True)
        by_pose = zip(self.by_pose.speeds, self.by_pose.polarities.signs, strict=True)
        ways = [*zip(by_twist, by_pose, strict=True)]
        if mode is Mode.NO_TWIST:
            ways = [(pose, twist) for twist, pose in ways]
        (speed, sign), (yaw_rate, yaw_sign) = (
            first if first[1] or not second[1] else second for first, second in ways
        )
        return motion._replace(speed=speed, yaw_rate=yaw_rate), (sign, yaw_sign)

    def _braking(self, mode: Mode, law: ControlLaw) -> Braking:
        """How to brake by speeds that are believed."""
        rate, holds = self._gently * self.safety.braking_rate, self._holds(law)
        way = self._way if mode.is_fault else 1
        sign, yaw_sign = self.polarities.signs
        if self._push is not None:
            return Braking(rate, rate * (yaw_sign or 1))
        drive, yaw = rate * (sign or way), rate * (yaw_sign or 1)
        # The other wheel can brake a turn, while the seal holds what it drives. What goes
        # against its torques has motors the wrong way round, or late ones: a seal stops both.
        # Where that is known of the yaw alone, the drive is left to the seal as well.
        is_against = drive < 0 or (yaw < 0 and sign == 0)
        if holds and (mode is Mode.DEAD_WHEEL or is_against):
            return Braking(0.0, yaw, carries=0.0)
        # nobody knows its heading where odometry is stuck
        carries = 0.0 if mode is Mode.STALLED and holds else way * self._carries
        return Braking(drive, yaw, carries)

    def _braking_in_doubt(
        self, mode: Mode, law: ControlLaw, motion: Motion, signs: tuple[int, int], doubted: int
    ) -> Braking:
        """How to brake by speeds that have been in doubt for so long [ns], of polarity `signs`."""
        rate, falls = self._gently * self.safety.braking_rate, self._falls(law)
        if mode is Mode.HEADING_WRONG and not falls:  # nobody knows how fast it goes ahead
            return Braking(0.0, rate, carries=0.0)
        if falls and mode is not Mode.SIGN_WRONG:  # a sign is more likely right
            signs = signs[0] or 1, signs[1] or 1
        rims = motion.speed, law.climber.half_track * motion.yaw_rate
        drive, yaw = (
            0.0 if sign or abs(rim) < SHAKEN else _shaking(doubted)
            for sign, rim in zip(signs, rims, strict=True)
        )
        return Braking(rate * signs[0], rate * signs[1], self._carries, (drive, yaw))


def _shaking(doubted: int) -> float:
    """Acceleration [m/s²] that shakes what has been in doubt for so long [ns]."""
    if doubted >= SHAKES:
        return 0.0
    return SHAKING if (doubted + HALF_SHAKE // 2) // HALF_SHAKE % 2 == 0 else -SHAKING


def _let_go(estimator: Estimator, age: float) -> Torques:
    estimator.sent(estimator.begin(age), NO_TORQUES)
    return NO_TORQUES


def _brake(
    estimator: Estimator,
    law: ControlLaw,
    age: float,
    braking: Braking,
    believed: Motion | None,
    push: Wrench = NO_WRENCH,
) -> Torques:
    """Torques that carry the weight and brake; raises `ValueError` if they are not finite.

    A `push` is carried as well; `believed` has the speeds that are braked, if not those of the
    estimator.
    """
    ahead = estimator.ahead(age)._replace(disturbance=push)
    if believed is not None:
        speeds = {"speed": believed.speed, "yaw_rate": believed.yaw_rate}
        ahead = ahead._replace(motion=ahead.motion._replace(**speeds))
    if age >= LONGEST_STEP:  # it has been braked, as far as can be known
        at_rest = ahead.motion._replace(speed=0.0, yaw_rate=0.0)
        ahead = ahead._replace(motion=at_rest)
    torques = law.braking(ahead, braking)
    check_finite(torques)
    estimator.sent(ahead.begins, torques)
    return torques
