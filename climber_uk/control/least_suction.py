"""The least pressure at which a climber keeps its margins, now and as far as a reference is known.

Less pressure is less load on the wheels and less friction of the seal: of each time of the preview
that pressure is sought from which on every one up to the full one keeps the margins asked for (§7).
Where less cannot be justified it is the full pressure: unless the climber follows its reference in
time, moves and goes on moving, and its pressure is measured.
"""

from dataclasses import replace
from math import exp, log1p
from typing import Any, NamedTuple

import numpy as np

from climber_uk.control.control_law import Command, ControlLaw
from climber_uk.control.controller import Answer, Controller
from climber_uk.control.safety import Mode
from climber_uk.control.time_scaling import IN_TIME, STANDSTILL
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.adhesion import Attachment, Suction
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.demand import NO_WRENCH, Demand, demanded
from climber_uk.mechanics.elementary import sign
from climber_uk.mechanics.quantities import Torques
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.wall import PLANE
from climber_uk.parameters.declaration import parameter, parameters

RESERVE = 0.02  # of the full pressure, above what is needed: for the pump's lag, and the gauge
STEPS = 32  # of pressure that are tried
SPACING = SECOND // 20  # [ns] of the times ahead that are looked at
LONGEST_STEP = 1.0  # [s] between two answers, after which nothing is known of what was between
NOT_MEASURED, TOO_WEAK = "pressure is not measured", "the pump does not reach what is needed"


@parameters
class SuctionOptions:
    """Suction that is asked of the pump: no more than margins need (`suction_setpoint`)."""

    enabled: bool = parameter(False, "", "publish suction_setpoint for the pump")
    slip_margin: float = parameter(
        2.0,
        "",
        "slip margin that is kept; lower: less pressure, and less for what comes unforeseen",
        at_least=1,
    )
    tip_margin: float = parameter(2.0, "", "tip margin that is kept", at_least=1)
    fall_rate: float = parameter(
        500.0, "Pa/s", "rate at which the suction setpoint falls", above=0, plausible=(1, 1e5)
    )
    rise_rate: float = parameter(
        8000.0,
        "Pa/s",
        "rate at which the suction setpoint rises to what is seen to be needed soon; to what is "
        "needed now, at once",
        above=0,
        plausible=(10, 1e6),
    )


class Need(NamedTuple):
    """Pressures [Pa] that are needed at once, and soon; and why all of it, if that is a trouble."""

    now: float
    soon: float
    trouble: str = ""


class LeastSuction:
    """The setpoint of a pump, from answer to answer.

    `climber` has the `suction_pressure` that the pump is good for. Pressures here are those that it
    comes to against the leak. Raises `ValueError` for an adhesion without a pump.
    """

    def __init__(self, options: SuctionOptions, climber: Climber, attachment: Attachment) -> None:
        if not isinstance(attachment.adhesion, Suction):
            raise ValueError(f"least_suction.enabled={options.enabled} needs adhesion=suction")
        self.options, self.climber, self.attachment = options, climber, attachment
        self.suction = attachment.adhesion
        self.comes_to = float(self.suction.final_pressure(1.0))  # of what the pump is set to
        self.full = self.comes_to * climber.suction_pressure
        self.reserve = RESERVE * self.full
        self._last, self._stamp = self.full, 0  # [ns]

    def setpoint(
        self, controller: Controller, answer: Answer | None, measured: float | None
    ) -> tuple[float, str]:
        """What the pump is to be set to [Pa] after an answer, and why to all of it, if a trouble.

        `measured` is the pressure [Pa], None if that of now is not known.
        """
        now, soon, trouble = self._need(controller, answer, measured)
        passed, self._stamp = (controller.stamp - self._stamp) / SECOND, controller.stamp
        passed = passed if 0 <= passed <= LONGEST_STEP else 0.0
        rises = min(soon, self._last + self.options.rise_rate * passed)
        falls = self._last - self.options.fall_rate * passed
        self._last = min(max(now, rises, falls), self.full)
        return self._last / self.comes_to, trouble

    def _need(self, controller: Controller, answer: Answer | None, measured: float | None) -> Need:
        everything = Need(self.full, self.full)
        command = None if answer is None else answer.command
        ahead = _ahead(controller)
        if answer is None or command is None or ahead is None:
            return everything
        if measured is None:
            return everything._replace(trouble=NOT_MEASURED)
        climber, learnt = controller.law.climber, controller.estimator.disturbance
        friction = self.attachment.seal_friction(climber)
        lowest = controller.safety.least_pressure
        wall = controller.law.wall or PLANE
        demands = [demanded(climber, friction, ahead, of, wall) for of in (NO_WRENCH, learnt)]
        needs = np.maximum(*(self.least(climber, demand, lowest) for demand in demands))
        if measured < min(needs[0], self.full - self.reserve):
            return everything._replace(trouble=TOO_WEAK)
        acting = _acting(controller.law, answer.wheels, command, demands[0])
        now = max(needs[0], *self.least(climber, acting, lowest)) + self.reserve
        if (ahead.speed * np.sign(ahead.speed[0])).min() < STANDSTILL:
            return Need(now, self.full)
        horizon = (len(needs) - 2) * SPACING / SECOND  # one has passed by the next look
        return Need(now, max(needs.max() + self.reserve, self.in_reach(horizon)))

    def in_reach(self, horizon: float) -> float:
        """Least pressure [Pa] from which it comes to the full one, but for the reserve, in time.

        That is seen to be needed a `horizon` [s] ahead, if not sooner. A pump that follows a ramp
        r t with a lag T is short of its end D by r T (exp(D / r T) - 1) exp(-t / T) at t > D / r.
        """
        rate, lag = self.options.rise_rate, self.suction.pump_time
        rise = rate * horizon
        if lag > 0:
            short = self.reserve / (rate * lag) * exp(min(horizon / lag, 100.0))
            rise = min(rise, rate * lag * log1p(short))
        return self.full - rise

    def least(self, climber: Climber, demand: Demand, lowest: float) -> Array:
        """Least pressure (n,) [Pa], from `lowest` on, with which demands (n,) keep their margins.

        It is the full one where that does not suffice either. The torques of `demand` are those at
        the pressure of `climber`.
        """
        attachment, options = self.attachment, self.options
        tried: Any = np.linspace(min(lowest, self.full), self.full, STEPS)
        at = replace(climber, suction_pressure=tried[:, None])
        rubs = attachment.seal_friction(at) - attachment.seal_friction(climber)
        right, left = (
            torque / climber.wheel_radius + rubs * demand.direction / 2 for torque in demand.torques
        )
        into = demand.into_wall
        slip = attachment.slip_margin(at, into, (right, left), demand.lateral, demand.across)
        tip = attachment.tip_margin(at, into, demand.along_wall)
        keeps = (slip >= options.slip_margin) & (tip >= options.tip_margin)
        keeps[-1] = True
        keeps = np.logical_and.accumulate(keeps[::-1])[::-1]
        return np.asarray(tried[keeps.argmax(axis=0)])


def _ahead(controller: Controller) -> Reference | None:
    """The reference (n,) from now on; None unless a climber that moves follows it in time."""
    active, motion = controller.active, controller.motion
    is_followed = controller.mode is Mode.FOLLOWING and active.progress.pace == IN_TIME
    if active.preview is None or motion is None or not is_followed or active.is_gentle:
        return None
    begin, end = active.progress.at(controller.stamp), int(active.preview.times[-1])
    points = [active.preview.target(time) for time in range(begin, end + 1, SPACING)]
    if not points or points[0] is None:
        return None
    known = np.array(points)
    ahead = Reference(known[:, :3], known[:, 3:6], known[:, 6:9], known[:, 9:])
    wanted = float(ahead.speed[0])
    goes = min(abs(wanted), motion.speed * sign(wanted)) >= STANDSTILL
    return ahead if goes else None


def _acting(law: ControlLaw, wheels: Torques, command: Command, planned: Demand) -> Demand:
    """Demand (1,) of torques that are sent."""
    into_wall, along_wall, across = law.gravity(command.motion)
    return Demand(
        torques=Torques(*(np.array([torque]) for torque in wheels)),
        lateral=np.array([command.lateral]),
        across=across,
        into_wall=into_wall,
        along_wall=along_wall,
        direction=planned.direction[:1],
    )
