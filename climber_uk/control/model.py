"""What the controller expects of the climber: how it rolls on, and what disturbs that.

    m v̇ = F - f σ - m g_t sinθ + r_F        J ω̇ = N + r_N

(11) and (15) with a disturbance r = (r_F, r_N) [N, N m] for all that the model does not know:
other mass or suction, a payload, a push; but what f is off by is learnt apart, as it changes its
sign with σ.
"""

from typing import Any, NamedTuple

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import (
    anywhere,
    clipped,
    everywhere,
    exp,
    rotated,
    select,
    swept,
    with_sign_of,
    wrapped,
)
from climber_uk.mechanics.many import chosen
from climber_uk.mechanics.quantities import Motion
from climber_uk.parameters.declaration import parameter, parameters

SLOW = 0.01  # [m/s] of a measured speed that may as well be rest
EXPECTED_REST = 1e-3  # [m/s] of an expected speed that is none
SLOW_TURN = 0.03  # [rad/s] of a measured yaw rate that may as well be none
FORGETTING_TIME = 0.2  # [s] of what was learnt, once the observer is off
TURNING_SHARE = 0.95  # of an unknown moment, put down to what resists turning
SETTLES = 0.2  # [s] after a rest, in which friction that lets go is a step, and no ramp
LETS_GO = 0.05  # [m/s] of what broke loose
UNSTICKING_TIME = 0.02  # [s] of unlearning what only held it at rest
STICTION_SPEED = 1e-3  # [m/s] asked for of what stands: then most of friction is overcome
STICTION_RATE = 20.0  # [1/s] of that ratio, at most: faster, and torques jump
MOST_STICTION = 6.0
NEARLY_ALL = 3.0  # of it, with 0.995 of friction
REST = 1e-4  # [m/s] of a reference that is at rest
PATIENCE = 3.0  # [s] in which it is forgotten
MOST_LEARNT = 0.4  # of K (2 T + δ), at most
Shares = tuple[Any, Any]  # of an error, put down to the disturbance and to its change


def predict(
    climber: Climber,
    motion: Motion,
    force: Any,
    moment: Any,
    time: float,
    friction: Any = 0.0,
    turning: Any = 0.0,
    aside: Any = 0.0,
) -> Motion:
    """Motion `time` [s] later under a constant force [N] and moment [N m], by the midpoint rule.

    Both include the disturbance; `friction` [N] is that of the seal beyond the model's f, `turning`
    [N m] what resists turning, and `aside` [m/s] how fast the wheels give way to the left.
    Friction ends a motion and reverses none; at rest it balances what pushes, up to all of it
    (docs/theory.md, §8.2).
    """
    mass, inertia, modelled, weight = climber.inertial
    friction = modelled + friction
    x, y, heading, cosine, sine, v, omega = motion
    if anywhere(turning != 0.0):
        moment = _turned(moment, turning, omega, inertia / time)
    half, omega_1 = 0.5 * time, moment / inertia
    halfway, angle = half * (omega + 0.5 * half * omega_1), time * (omega + half * omega_1)
    c, s, heading, cosine, sine = swept(heading, cosine, sine, halfway, angle)
    push = force - weight * s
    # sliding, friction is all of f, against the motion; at rest, as much as is pushed against it
    rubbing, slides = with_sign_of(friction, v), v != 0.0
    if not (slides is True or everywhere(slides)):
        rubbing = select(slides, rubbing, clipped(push, -friction, friction))
    v_1 = (push - rubbing) / mass + omega * aside
    displacement, end = time * (v + half * v_1), v + time * v_1
    stops = slides & (with_sign_of(1.0, v) * end < 0)  # v * end may be too small for a number
    if stops is not False and anywhere(stops):  # friction ends a motion, and does not reverse it
        left = time + v / select(stops, v_1, 1.0)
        back_1 = (push - clipped(push, -friction, friction)) / mass
        displacement = select(stops, 0.5 * (v * (time - left) + left * left * back_1), displacement)
        end = select(stops, left * back_1, end)
    v, omega = end, omega + time * omega_1
    aside = time * aside
    x, y = x + displacement * c - aside * s, y + displacement * s + aside * c
    return Motion(x, y, heading, cosine, sine, v, omega)


def _turned(moment: Any, turning: Any, omega: Any, stopping: Any) -> Any:
    """Moment [N m] that is left of what resists turning, which ends a turn and reverses none.

    `stopping` [kg m²/s] is the moment that ends it, by its rate. What hardly turns is held.
    """
    turns = abs(omega) > SLOW_TURN
    left = moment - select(turns, with_sign_of(turning, omega), clipped(moment, -turning, turning))
    stops = turns & (abs(moment) < turning) & (omega * (omega + left / stopping) < 0)
    return select(stops, -stopping * omega, left)


class DisturbanceEstimate(NamedTuple):
    """What is known of the disturbance: itself, and how it changes."""

    force: Any = 0.0  # r_F [N]
    moment: Any = 0.0  # r_N [N m]
    force_rate: Any = 0.0  # [N/s]
    moment_rate: Any = 0.0  # [N m/s]
    friction: Any = 0.0  # [N] of the seal beyond the model's f; -f to f
    turning: Any = 0.0  # [N m] that resists turning: none in the model
    settling: Any = 0.0  # [s] left after a rest: what was learnt there may hold there only
    stuck: Any = 0.0  # [N] of force and friction that was learnt there, and is believed yet
    stiction: Any = 0.0  # tanh of it: share of friction that held it where a reference rests

    @property
    def without_rates(self) -> "DisturbanceEstimate":
        """The same while nothing can be learnt."""
        return self._replace(force_rate=0.0, moment_rate=0.0)

    def asked(self, forward: Any, held: Any, time: float) -> "DisturbanceEstimate":
        """With an acceleration [m/s²] asked for, for `time` [s], of what may be `held` by friction.

        It is taken back once it moves, its reference does, or the opposite is asked for.
        """
        most, before = STICTION_RATE * time, self.stiction
        back = clipped(before, -NEARLY_ALL, NEARLY_ALL)
        before = select(held & (before * forward >= 0.0), before, back)
        change = select(held, time * (forward / STICTION_SPEED - before / PATIENCE), -before)
        stiction = clipped(before + clipped(change, -most, most), -MOST_STICTION, MOST_STICTION)
        return self._replace(stiction=stiction)

    def lets_go(self, unexpected: Any, speed: Any, time: float) -> Any:
        """How much [N] of what was learnt at rest is taken back in `time` [s], soon after it.

        An `unexpected` force [N] that is against it shows, at a `speed` [m/s], that friction is
        less in motion: the observer is too slow for that.
        """
        most = abs(self.stuck)
        lets_go = (self.stuck * unexpected < 0.0) & (abs(speed) > LETS_GO)
        share = 1.0 - exp(-time / UNSTICKING_TIME)
        return select(lets_go, share * clipped(unexpected, -most, most), 0.0)

    def changed(
        self, climber: Climber, change: Any, direction: float, speed: Any
    ) -> tuple[Any, Any]:
        """Force and friction [N] as a `change` of both together [N] teaches.

        At `speed` [m/s] in a `direction` (1, -1) the two cannot be told apart: each takes half, the
        least correction that explains it. The other direction shows the rest. In none (0), or
        where it slides the other way, all of it is put down to the force.
        """
        f, before = climber.seal_friction, self.friction
        friction = clipped(before - 0.5 * direction * change, -f, f)
        friction = select(direction * speed > -SLOW, friction, before)
        return self.force + change + direction * (friction - before), friction

    def turned(self, climber: Climber, change: Any, direction: Any, rate: Any) -> tuple[Any, Any]:
        """The same of the moment and of what resists turning [N m], at a yaw `rate` [rad/s].

        It may be as much as the motors can overcome. Nothing but it is likely to be as large, so
        that it takes most of a change.
        """
        before, lever = self.turning, climber.half_track / climber.wheel_radius
        turning = before - TURNING_SHARE * direction * change
        turning = clipped(turning, 0.0, 2 * lever * climber.max_wheel_torque)
        turning = select(direction * rate > -SLOW_TURN, turning, before)
        return self.moment + change + direction * (turning - before), turning


@parameters(slots=True)
class Observer:
    """Learns the disturbance, and the speeds if need be, from what comes out other than expected.

    With measured speeds it is a momentum observer of second order: a disturbance that grows
    steadily leaves no error. Both poles are at K, or lower: K (2 T + δ) <= `MOST_LEARNT`, with T
    the period and δ the delay that is known. Without measured speeds it is a filter of poses with
    two poles at `pose_bandwidth`, and one at K/2. What stiction balances is not learnt: the model
    expects no motion.
    """

    bandwidth: float = parameter(
        14.0, "1/s", "K of the disturbance observer; 0 switches it off", at_least=0, runtime=True
    )
    velocity_source: str = parameter(
        "odometry",
        "",
        "where speeds are taken from; pose: for odometry without a twist",
        choices=("odometry", "pose"),
    )
    twist: str = parameter(
        "auto",
        "",
        "speeds of odometry: those of its stamp, or means of the period before, as of encoders",
        choices=("auto", "instantaneous", "mean"),
    )
    side_slip_bandwidth: float = parameter(
        6.0,
        "1/s",
        "how fast it is learnt by how much wheels give way sideways, from poses beside measured "
        "speeds; 0: they hold",
        at_least=0,
        runtime=True,
    )
    side_slip_source: str = parameter(
        "pose",
        "",
        "what sideways slip is learnt from; odometry: from `twist.linear.y`, of wall_odometry "
        "whose wheels scrub, as its poses have the noise of fixes; of a driver that tells 0, "
        "wheels are taken to hold",
        choices=("odometry", "pose"),
    )
    pose_bandwidth: float = parameter(
        60.0, "1/s", "bandwidth of the filter that takes speeds from poses", above=0, runtime=True
    )

    def corrected(
        self,
        climber: Climber,
        learnt: DisturbanceEstimate,
        expected: Motion,
        measured: Motion,
        time: float,
        shares: Shares,
        direction: float = 0.0,
        turn: Any = 0.0,
    ) -> tuple[Motion, DisturbanceEstimate]:
        """Motion and disturbance after `time` [s] in which `expected` became `measured`.

        `shares` are those of the observer for that time; `direction` is 1 where the climber is to
        drive forwards, -1 backwards, 0 at rest; `turn` is the same to the left and to the right.
        """
        if self.velocity_source == "pose":
            return self._from_pose(climber, learnt, expected, measured, time, direction, turn)
        if everywhere(self.bandwidth == 0):
            return measured, _faded(learnt, time)
        _, _, force_rate, moment_rate, _, turning, settling, stuck, stiction = learnt
        mass, inertia, _, _ = climber.inertial
        new, newer = shares
        acceleration = (measured.speed - expected.speed) / time
        yaw_acceleration = (measured.yaw_rate - expected.yaw_rate) / time
        creeps = (abs(expected.speed) < EXPECTED_REST) & (abs(measured.speed) < EXPECTED_REST)
        unexpected = select(creeps, 0.0, mass * acceleration)
        unlearnt = learnt.lets_go(unexpected, measured.speed, time)
        rests, slides = settling == SETTLES, settling == 0.0
        force_rate = select(rests | slides, force_rate, 0.0)  # what lets go is a step, no ramp
        change = time * force_rate + unlearnt + new * (unexpected - unlearnt)
        stuck = select(slides, 0.0, stuck + select(rests, change, unlearnt))
        force, friction = learnt.changed(climber, change, direction, expected.speed)
        change = time * moment_rate + new * inertia * yaw_acceleration
        moment, turning = learnt.turned(climber, change, turn, expected.yaw_rate)
        # at rest stiction balances any force, so that no change of it shows
        ramps = (abs(expected.speed) > EXPECTED_REST) & (rests | slides)
        force_rate = select(ramps, force_rate + newer / time * unexpected, 0.0)
        moment_rate = moment_rate + newer / time * inertia * yaw_acceleration
        held = (turning > 0.0) & (abs(expected.yaw_rate) < EXPECTED_REST)
        moment_rate = select(held, 0.0, moment_rate)
        resisting = friction, turning
        learnt = DisturbanceEstimate(
            force, moment, force_rate, moment_rate, *resisting, settling, stuck, stiction
        )
        return measured, learnt

    def shares(self, time: float, delay: float) -> Shares:
        """Shares of an unexpected acceleration: disturbance, and its change in `time` [s].

        `delay` [s] is that of torques.
        """
        most = MOST_LEARNT * time / (2.0 * time + delay)
        new = 1.0 - exp(-clipped(self.bandwidth * time, 0.0, most))
        return 2.0 * new, new * new

    def _from_pose(
        self,
        climber: Climber,
        learnt: DisturbanceEstimate,
        expected: Motion,
        measured: Motion,
        time: float,
        direction: float,
        turn: Any,
    ) -> tuple[Motion, DisturbanceEstimate]:
        x, y, heading, cosine, sine, v, omega = expected
        ahead = (measured.x - x) * cosine + (measured.y - y) * sine
        beside = (measured.y - y) * cosine - (measured.x - x) * sine
        heading_change = wrapped(measured.heading - heading)

        # two poles of the filter, and one of the disturbance, which as the observer's two is 2 / K
        # late; 1 if there is none, so that k = 0
        memory = exp(-self.pose_bandwidth * time)
        slow = exp(-0.5 * self.bandwidth * time)
        new = 1 - memory
        g, k = 1 - memory * memory * slow, new * new * (1 - slow)
        h = 3 - g - 0.5 * k - 2 * memory - slow
        learnt = chosen(self.bandwidth > 0, learnt, _faded(learnt, time))
        x, y = x + g * (ahead * cosine - beside * sine), y + g * (ahead * sine + beside * cosine)
        v, omega = v + h / time * ahead, omega + h / time * heading_change
        motion = Motion(x, y, *rotated(heading, cosine, sine, g * heading_change), v, omega)
        mass, inertia, _, _ = climber.inertial
        force, friction = learnt.changed(climber, k / time**2 * mass * ahead, direction, v)
        moment, turning = learnt.turned(
            climber, k / time**2 * inertia * heading_change, turn, omega
        )
        return motion, DisturbanceEstimate(
            force, moment, friction=friction, turning=turning, stiction=learnt.stiction
        )


def _faded(learnt: DisturbanceEstimate, time: float) -> DisturbanceEstimate:
    left = exp(-time / FORGETTING_TIME)
    force, moment, _, _, friction, turning, _, _, stiction = learnt
    return DisturbanceEstimate(
        *(left * force, left * moment),
        friction=left * friction,
        turning=left * turning,
        stiction=stiction,
    )
