"""`unicycle.advanced_often` for many climbers, compiled by numba: the extra `fast`.

No equation stands here: numba compiles the functions of `unicycle` as they are, and gets anew only
how to select, clip and rotate (`FOR_NUMBA`). The control law is not compiled: numpy's tanh and
arctan do eight at a time and numba's one, so that nothing would be won.
"""

from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload, register_jitable

from climber_uk.closed_loop import unicycle
from climber_uk.closed_loop.unicycle import Accelerations, UnicycleModel
from climber_uk.mechanics import Array, elementary, many
from climber_uk.mechanics.quantities import Motion, Wrench

CLIMBERS_AT_ONCE = 256  # whose numbers stay in the cache
MAX_ROTATION = 0.1  # [rad] in a step: up to that the series is good to 1e-16
# numpy's division, a product and a sum in one: as in C; `forceinline` lets LLVM do eight at once
LIKE_C: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
INLINE = LIKE_C | {"forceinline": True}


def _rotated(heading: Any, cosine: Any, sine: Any, angle: Any) -> tuple[Any, Any, Any]:
    """`elementary.rotated` without a branch, which would keep LLVM from doing eight at once."""
    q = angle * angle
    c = 1 - q * (1 / 2) * (1 - q * (1 / 12) * (1 - q * (1 / 30) * (1 - q * (1 / 56))))
    s = 1 - q * (1 / 6) * (1 - q * (1 / 20) * (1 - q * (1 / 42) * (1 - q * (1 / 72))))
    s = angle * s
    return heading + angle, c * cosine - s * sine, s * cosine + c * sine


def _swept(
    heading: Any, cosine: Any, sine: Any, halfway: Any, angle: Any
) -> tuple[Any, Any, Any, Any, Any]:
    _, c, s = elementary.rotated(heading, cosine, sine, halfway)
    heading, cosine, sine = elementary.rotated(heading, cosine, sine, angle)
    return c, s, heading, cosine, sine


def _amended(condition: Any, regular: Any, exceptional: Any, *arguments: Any) -> Any:
    return exceptional(*arguments) if condition else regular


FOR_NUMBA = {
    elementary.sign: lambda x: float((x > 0) - (x < 0)),
    elementary.with_sign_of: lambda size, of: size if of >= 0 else -size,
    elementary.clipped: lambda value, lowest, highest: min(max(value, lowest), highest),
    elementary.select: lambda condition, this, that: this if condition else that,
    elementary.rotated: _rotated,
    elementary.swept: _swept,
    many.amended: _amended,
}
for function, replacement in FOR_NUMBA.items():
    overload(function, strict=False, jit_options=INLINE)(lambda *_, chosen=replacement: chosen)
for function in (unicycle.slid, unicycle._stuck, unicycle._applied):
    register_jitable(**INLINE)(function)
RARE = unicycle._stopped, unicycle._from_rest, unicycle._to_rest, unicycle._broken_loose
for function in (*RARE, unicycle.stepped):
    register_jitable(**LIKE_C)(function)


def advanced(
    body: UnicycleModel, motion: Motion, wrench: Wrench, time: float, steps: int
) -> Motion:
    """Motions (N,) after `steps` steps of `time` [s]."""
    fastest = abs(motion.yaw_rate) + steps * time * abs(wrench.moment / body.yaw_inertia)
    if not np.max(fastest, initial=0.0) * time <= MAX_ROTATION:
        return unicycle.advanced_often(body, motion, wrench, time, steps)
    rows = np.empty((11, len(motion.x)))
    for row, numbers in zip(rows, (*motion, *body.under(wrench)), strict=True):
        row[:] = numbers
    _advance(rows, time, steps)
    return Motion(*rows[:7])


@njit(nogil=True, **LIKE_C)
def _advance(rows: Array, time: float, steps: int) -> None:
    now, end = np.empty((11, CLIMBERS_AT_ONCE)), np.empty((7, CLIMBERS_AT_ONCE))
    for first in range(0, rows.shape[1], CLIMBERS_AT_ONCE):
        number = min(CLIMBERS_AT_ONCE, rows.shape[1] - first)
        now[:, :number] = rows[:, first : first + number]
        for _ in range(steps):
            _slide(now, end, time, number)
            for i in range(number):
                if not now[5, i] * end[5, i] > 0:  # it rests, or stops
                    rates, motion = _get(now, i)
                    _put(end, i, unicycle.stepped(rates, motion, time))
            now[:7, :number] = end[:, :number]
        rows[:7, first : first + number] = now[:7, :number]


@njit(**LIKE_C)
def _slide(now: Array, end: Array, time: float, number: int) -> None:
    for i in range(number):
        rates, motion = _get(now, i)
        friction = elementary.with_sign_of(rates.friction, motion.speed)
        _put(end, i, unicycle.slid(rates, motion, friction, time))


@njit(**INLINE)
def _get(a: Array, i: int) -> tuple[Accelerations, Motion]:
    motion = Motion(a[0, i], a[1, i], a[2, i], a[3, i], a[4, i], a[5, i], a[6, i])
    return Accelerations(a[7, i], a[8, i], a[9, i], a[10, i]), motion


@njit(**INLINE)
def _put(a: Array, i: int, motion: Motion) -> None:
    a[0, i], a[1, i], a[2, i] = motion.x, motion.y, motion.heading
    a[3, i], a[4, i], a[5, i] = motion.cosine, motion.sine, motion.speed
    a[6, i] = motion.yaw_rate
