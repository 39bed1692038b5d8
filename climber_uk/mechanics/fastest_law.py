"""The fastest time law: s(t) of a table, which `check_path --fastest` makes for path and climber.

s(t) is a spline of degree 5 whose coefficients, even in time, are the table. So its derivatives are
means of those of the table's steps nearby: of a motion that changes its acceleration abruptly it
makes one that is smooth to the jerk, no faster and no harder.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives
from climber_uk.mechanics.shapes import Shape
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.text_file import at_home, text_of

DEGREE = 5
MATCHES = 1e-6  # of the path's extent


class TabulatedLaw:
    """s(t) of a table, once along from rest to rest: a `TimeLaw`."""

    rate: ClassVar[float] = 0.0  # the path's parameter is not stretched
    stops: ClassVar[bool] = True
    source: ClassVar[str] = "a table"

    @property
    def given(self) -> tuple[float, Array]:
        """Period [s] and table (n,) of s, which rests for six rows at 0 and at its end."""
        raise NotImplementedError

    @cached_property
    def _spline(self) -> Any:
        return spline(*self.given)

    def duration(self, shape: Shape) -> float:
        """See `TimeLaw`; raises `ValueError` if the table is of another path."""
        period, table = self.given
        if not math.isclose(table[-1], shape.length, rel_tol=MATCHES):
            raise ValueError(
                f"{self.source} is for a path of extent {table[-1]:.6g}, not "
                f"{shape.length:.6g}: make it again by check_path --fastest"
            )
        return period * (len(table) - DEGREE)

    def horizon(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        return self.duration(shape)

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """See `TimeLaw`."""
        end = self.duration(shape)
        within = np.clip(time, 0.0, end)
        moves = (within > 0.0) & (within < end)
        s, *rates = (self._spline(within, order) for order in range(4))
        s_1, s_2, s_3 = (rate * moves for rate in rates)
        return np.clip(s, 0.0, shape.length), s_1, s_2, s_3


@dataclass(frozen=True, eq=False)
class Tabulated(TabulatedLaw):
    """The law of a table that is given."""

    period: float  # [s]
    table: Array  # (n,) s

    @property
    def given(self) -> tuple[float, Array]:
        """See `TabulatedLaw`."""
        return self.period, self.table


@parameters
class Fastest(TabulatedLaw):
    """As fast as margins, motors and limits allow at each place: the table of a file.

    Raises `ValueError` naming the file.
    """

    file: str = parameter(
        "", "", "what check_path --fastest wrote, for this path and climber", is_path=True
    )

    @property
    def source(self) -> str:  # type: ignore[override]
        """What an error calls the table."""
        return f"file={self.file!r}"

    @cached_property
    def given(self) -> tuple[float, Array]:  # type: ignore[override]
        """See `TabulatedLaw`."""
        try:
            return read_table(at_home(self.file))
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or " ".join(str(error).split())
            raise ValueError(f"{self.source}: {reason}") from None


def spline(period: float, table: Array) -> Any:
    """s(t), a BSpline from 0 to `period` [s] times (len(table) - 5)."""
    from scipy.interpolate import BSpline  # slow to import

    knots = period * (np.arange(len(table) + DEGREE + 1) - DEGREE)
    return BSpline(knots, table, DEGREE)


def read_table(path: Path) -> tuple[float, Array]:
    """Period [s] and table (n,) of a file; raises `OSError`, or `ValueError` for a bad one."""
    lines = text_of(path).splitlines()[1:]
    rows = np.loadtxt(lines, delimiter=",", ndmin=2) if lines else np.empty((0, 2))
    if rows.shape[1:] != (2,) or len(rows) < 2 * DEGREE + 2 or not np.isfinite(rows).all():
        raise ValueError(f"must have {2 * DEGREE + 2} rows or more of two finite numbers, t and s")
    time, table = rows.T
    period = (time[-1] - time[0]) / (len(time) - 1)
    if not (period > 0 and np.allclose(np.diff(time), period, rtol=1e-3)):
        raise ValueError("t must be even")
    ends = table[: DEGREE + 1].any() or (table[-DEGREE - 1 :] != table[-1]).any()
    if ends or (np.diff(table) < 0).any():
        raise ValueError(f"s must not fall, and rest for {DEGREE + 1} rows at 0 and at its end")
    return float(period), table


def write_table(path: Path, period: float, table: Array) -> None:
    """Write what `read_table` reads."""
    rows = np.column_stack([period * np.arange(len(table)), table])
    np.savetxt(path, rows, fmt=("%.9g", "%.12g"), delimiter=",", header="t,s", comments="")
