"""What an operator, the battery and the tether may stop a climber by, though nothing is wrong.

Such a stop lasts: until it is over *and* the controller is enabled again, by somebody who has seen
to it. The safe output is as ever, and with `hold` a climber on a wall does not fall for it.
"""

import math

from climber_uk.control.safety import Mode, Trouble
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Motion
from climber_uk.parameters.declaration import parameter, parameters

STOPS = Mode.EMERGENCY_STOP, Mode.LOW_BATTERY, Mode.TETHER
STEP = 0.01  # [m] from which on a way counts: noise of a pose adds up to none


@parameters
class StopOptions:
    """Which of these stops there are; what is off is not subscribed."""

    emergency_stop: bool = parameter(
        False, "", "a true on `emergency_stop` stops; left false, nobody hears that button"
    )
    emergency_timeout: float = parameter(
        0.0,
        "s",
        "silence of `emergency_stop`, by the node's clock, that stops; 0: a lost button stops "
        "nothing; shorter than its period: always stopped",
        at_least=0,
        plausible=(0.05, 60),
    )
    least_charge: float = parameter(
        0.0,
        "",
        "share of `battery_state`'s charge below which the climber stops; 0: not looked at; too "
        "low: motors and pump may stop first",
        at_least=0,
        at_most=1,
    )
    least_voltage: float = parameter(
        0.0,
        "V",
        "`battery_state`'s voltage below which the climber stops; 0: not looked at; it sags "
        "under load: too high stops early",
        at_least=0,
    )
    tether_length: float = parameter(
        0.0,
        "m",
        "way on the wall, to and fro, after which the climber stops; 0: never; too long: the "
        "tether pulls",
        at_least=0,
    )

    def __post_init__(self) -> None:
        if self.emergency_timeout and not self.emergency_stop:
            raise ValueError(
                f"emergency_timeout={self.emergency_timeout} [s] needs emergency_stop=true"
            )

    @property
    def reads_battery(self) -> bool:
        """Whether the battery is to be looked at."""
        return self.least_charge > 0 or self.least_voltage > 0


class Stops:
    """Hears of all these; times are of the node's clock [ns]."""

    def __init__(self, options: StopOptions | None = None) -> None:
        self.options = options or StopOptions()
        self.way = 0.0  # [m] on the wall, since the start, or since its end was forgiven
        self._lasting: Trouble | None = None  # the last cause
        self._pressed: Trouble | None = None  # what the emergency stop says now
        self._battery: Trouble | None = None  # what that says now
        self._heard: int | None = None  # when the emergency stop was, last
        self._counted: Motion | None = None  # up to where the way is counted

    def enable(self) -> None:
        """Forgive what is over; where the tether ended the way, it is counted anew."""
        if self._lasting is not None and self._lasting[0] is Mode.TETHER:
            self.way = 0.0
        self._lasting = self._pressed or self._battery

    def press(self, is_pressed: bool, now: int) -> None:
        """Take what the emergency stop says."""
        self._pressed = (Mode.EMERGENCY_STOP, "pressed") if is_pressed else None
        self._heard, self._lasting = now, self._pressed or self._lasting

    def see_battery(self, charge: float, voltage: float) -> None:
        """Take a battery's charge, 0 to 1, and voltage [V]; nan: not measured.

        Raises `ValueError` if that is what is to be looked at.
        """
        options, low = self.options, []
        for name, value, least, text in (
            ("percentage", charge, options.least_charge, "{:.0%}"),
            ("voltage", voltage, options.least_voltage, "{:.2f} V"),
        ):
            if least and not math.isfinite(value):
                raise ValueError(f"{name}={value} is not measured, and there is a least {name}")
            if value < least:
                low.append(f"{text.format(value)} < {text.format(least)}")
        self._battery = (Mode.LOW_BATTERY, ", ".join(low)) if low else None
        self._lasting = self._lasting or self._battery

    def move(self, motion: Motion | None) -> None:
        """Count the way to where a climber is; None: it is elsewhere next."""
        before = self._counted
        if motion is None or before is None:
            self._counted = motion
            return
        step = math.hypot(motion.x - before.x, motion.y - before.y)
        if step >= STEP:
            self.way, self._counted = self.way + step, motion
        if 0 < self.options.tether_length < self.way:
            detail = f"{self.way:.2f} m > {self.options.tether_length:g} m"
            self._lasting = self._lasting or (Mode.TETHER, detail)

    def trouble(self, now: int) -> Trouble | None:
        """Mode and detail of a stop, if there is one."""
        timeout = self.options.emergency_timeout
        if timeout and self._heard is None:
            return Mode.EMERGENCY_STOP, "not heard yet"
        if timeout and self._heard is not None:
            self._heard = min(self._heard, now)  # a clock may go back
            silent = (now - self._heard) / SECOND
            if silent > timeout:
                self._lasting = self._lasting or (Mode.EMERGENCY_STOP, f"silent for {silent:.2g} s")
        return self._lasting
