"""The pressure that controllers know: sent in each period of a gauge, as between the nodes."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from climber_uk.control.control_law import ControlLaw
from climber_uk.mechanics.climber import Climber


def controllers(
    law: ControlLaw, climbers: Iterable[Climber], period: float, gauge: float
) -> Iterator[ControlLaw]:
    """Control law at every `period` [s], with the pressure that was received last.

    It is sent each `gauge` [s], or never if that is 0. A message holds the pressure of the period
    before it, and is received in the period after it.
    """
    known: Climber | None = None
    before: Climber | None = None  # two periods ago
    last: Climber | None = None
    for tick, climber in enumerate(climbers):
        sent = before or climber
        if gauge > 0 and sent is not known and (tick == 0 or _is_sent(tick - 1, period, gauge)):
            known, pressure = sent, sent.suction_pressure
            model = replace(law.climber, suction_pressure=pressure)
            law = replace(law, climber=model)
        yield law
        before, last = last, climber


def _is_sent(tick: int, period: float, gauge: float) -> bool:
    before, now = (math.floor((tick - back) * period / gauge + 1e-9) for back in (1, 0))
    return now != before
