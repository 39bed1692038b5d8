"""What controllers know of the pressure, when: as between the nodes, each period of a gauge."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from climber_uk.control.control_law import ControlLaw
from climber_uk.mechanics.climber import Climber


def controllers(
    law: ControlLaw, climbers: Iterable[Climber], period: float, gauge: float
) -> Iterator[ControlLaw]:
    """Controller at every `period` [s], with the pressure that it was told last.

    Each `gauge` [s], or never if that is 0. What is told in a period is how it was in the one
    before, and it is known in the one after.
    """
    known: Climber | None = None
    before: Climber | None = None  # two periods ago
    last: Climber | None = None
    for tick, climber in enumerate(climbers):
        found = before or climber
        if gauge > 0 and found is not known and (tick == 0 or _is_told(tick - 1, period, gauge)):
            known, pressure = found, found.suction_pressure
            model = replace(law.climber, suction_pressure=pressure)
            law = replace(law, climber=model)
        yield law
        before, last = last, climber


def _is_told(tick: int, period: float, gauge: float) -> bool:
    before, now = (math.floor((tick - back) * period / gauge + 1e-9) for back in (1, 0))
    return now != before
