"""What the controller expects of the climber: how it rolls on, and what disturbs that.

    m v̇ = F - f σ - m g_t sinθ + r_F        J ω̇ = N + r_N

(11) and (15) with a disturbance r = (r_F, r_N) [N, N m] for all that the model does not know:
other friction, mass or suction, a payload, a push.
"""

import math
from dataclasses import dataclass

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import Climber, State, across, along
from climber_uk.mechanics.elementary import clipped, cos, select, sign, sin, wrapped
from climber_uk.mechanics.parameter import check, parameter

SLOW = 0.01  # [m/s] of a measured speed that may as well be rest
FORGETTING_TIME = 0.2  # [s] of what was learnt, once the observer is off
NO_FRICTION = 1e-9  # [N] too little to hold anything


def rolled(
    climber: Climber, state: State, torques: Array, disturbance: Array, time: float
) -> State:
    """State `time` [s] later under constant torques (..., 2), by the midpoint rule.

    At rest friction takes whatever value holds the climber, up to f; `disturbance` is (..., 2).
    """
    if time == 0:
        return state
    x, y, heading = unpack(state.pose)
    v, omega = state.forward_speed, state.yaw_rate
    drive, turn = climber.drive_and_turn(torques)
    r_drive, r_turn = unpack(disturbance)
    omega_1 = (turn + r_turn) / climber.yaw_inertia
    middle = heading + omega * time / 2 + omega_1 * time**2 / 8
    push = drive - climber.weight_along_wall * sin(middle) + r_drive
    friction = climber.seal_friction
    held = clipped(push / max(friction, NO_FRICTION), -1.0, 1.0)
    v_1 = (push - friction * select(abs(v) > SLOW, sign(v), held)) / climber.mass
    way = time * (v + time / 2 * v_1)
    pose = pack(
        x + way * cos(middle),
        y + way * sin(middle),
        heading + time * (omega + time / 2 * omega_1),
    )
    return State.rolling(pose, v + time * v_1, omega + time * omega_1)


@dataclass(frozen=True)
class Observer:
    """Learns the disturbance, and the speeds if need be, from what comes out other than expected.

    With measured speeds it is the momentum observer ṙ = K (M q̈ - what the model and r say).
    Without them it is a critically damped filter of poses (fading memory of third order, or of
    second order if K = 0). What friction holds teaches nothing: the model expects no motion.
    """

    bandwidth: float = parameter(
        100.0, "1/s", "K of the disturbance observer; 0 switches it off", at_least=0, runtime=True
    )
    velocity_source: str = parameter(
        "odometry",
        "",
        "where speeds are taken from; pose: for odometry without a twist",
        choices=("odometry", "pose"),
    )
    pose_bandwidth: float = parameter(
        60.0, "1/s", "of the filter that takes speeds from poses", above=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def corrected(
        self, climber: Climber, disturbance: Array, expected: State, found: State, time: float
    ) -> tuple[State, Array]:
        """State and disturbance (..., 2) after `time` [s] in which `expected` became `found`."""
        if self.velocity_source == "pose":
            return self._from_pose(climber, disturbance, expected, found, time)
        if self.bandwidth == 0:
            return found, disturbance * math.exp(-time / FORGETTING_TIME)
        share = (1 - math.exp(-self.bandwidth * time)) / time
        faster = found.forward_speed - expected.forward_speed
        turning = found.yaw_rate - expected.yaw_rate
        return found, _more(climber, disturbance, share * faster, share * turning)

    def _from_pose(
        self, climber: Climber, disturbance: Array, expected: State, found: State, time: float
    ) -> tuple[State, Array]:
        offset, heading = found.pose - expected.pose, expected.heading
        ahead, beside = along(heading, offset), across(heading, offset)
        turned = wrapped(unpack(offset)[2])

        memory = math.exp(-self.pose_bandwidth * time)
        new = 1 - memory
        if self.bandwidth > 0:
            g, h, k = 1 - memory**3, 1.5 * (1 - memory**2) * new, new**3
        else:
            g, h, k = 1 - memory**2, new**2, 0.0
            disturbance = disturbance * math.exp(-time / FORGETTING_TIME)
        x, y, _ = unpack(expected.pose)
        cosine, sine = cos(heading), sin(heading)
        pose = pack(
            x + g * (ahead * cosine - beside * sine),
            y + g * (ahead * sine + beside * cosine),
            heading + g * turned,
        )
        state = State.rolling(
            pose,
            expected.forward_speed + h / time * ahead,
            expected.yaw_rate + h / time * turned,
        )
        return state, _more(climber, disturbance, k / time**2 * ahead, k / time**2 * turned)


def _more(climber: Climber, disturbance: Array, v_1: Array, omega_1: Array) -> Array:
    r_drive, r_turn = unpack(disturbance)
    return pack(r_drive + climber.mass * v_1, r_turn + climber.yaw_inertia * omega_1)
