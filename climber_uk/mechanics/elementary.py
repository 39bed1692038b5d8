"""Elementary functions of floats or arrays (N,), so that one formula serves one climber or many.

Floats stay floats: numpy's functions turn a float into a numpy scalar, and arithmetic on those
takes three times as long. Conditions are a bool, or an array (N,) of them: `select` and
`everywhere` take the place of `if`.

Arrays are numpy's or JAX's. The values of the latter are not known while a loop is traced, and
nothing is left out for what they are: of them `everywhere` is False and `anywhere` True.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from climber_uk.mechanics import Array, namespace

FULL_TURN = 2 * math.pi  # [rad]
AT_ONCE = 0.05  # [s] from one angle of a wheel to the next
ROUNDING = 1e-3  # [rad]
Derivatives = tuple[Any, Any, Any, Any]  # (...) of order 0, 1, 2, 3


def _either(of_float: Callable[[float], float], name: str) -> Any:
    return lambda x: of_float(x) if isinstance(x, float) else getattr(namespace(x), name)(x)


cos = _either(math.cos, "cos")
sin = _either(math.sin, "sin")
arctan = _either(math.atan, "arctan")
tanh = _either(math.tanh, "tanh")
sqrt = _either(math.sqrt, "sqrt")
exp = _either(math.exp, "exp")
sign = _either(lambda x: math.copysign(1.0, x) if x else 0.0, "sign")


def arctan2(y: Any, x: Any) -> Any:
    """Angle of (x, y), in [-π, π]."""
    return math.atan2(y, x) if isinstance(y, float) else np.arctan2(y, x)


def larger(this: Any, that: Any) -> Any:
    """The larger one of two arrays, element by element; not a number if either is none."""
    return namespace(this).maximum(this, that)


def smaller(this: Any, that: Any) -> Any:
    """The smaller one of two arrays; see `larger`."""
    return namespace(this).minimum(this, that)


def with_sign_of(size: Any, of: Any) -> Any:
    """`size` (>= 0) with the sign of `of`; where all of an array are positive, `size` itself."""
    if isinstance(of, float):
        return math.copysign(size, of)
    if namespace(of) is np and of.min(initial=np.inf) > 0:
        return size
    return namespace(of).copysign(size, of)


def wrapped(angle: Any) -> Any:
    """The angle [rad] in [-π, π)."""
    if isinstance(angle, float):
        return angle if -3.0 < angle < 3.0 else (angle + math.pi) % FULL_TURN - math.pi
    if namespace(angle) is np and np.abs(angle).max(initial=0.0) < 3.0:
        return angle
    # numpy's remainder takes ten times as long
    return angle - FULL_TURN * namespace(angle).floor(angle / FULL_TURN + 0.5)


def clipped(value: Any, lowest: Any, highest: Any) -> Any:
    """`value` clipped to its bounds; `highest` if they contradict each other."""
    if isinstance(value, float):
        raised = lowest if value < lowest else value
        return highest if raised > highest else raised
    return namespace(value).clip(value, lowest, highest)


def select(condition: Any, this: Any, that: Any) -> Any:
    """`this` where `condition` holds, else `that`."""
    if condition is True or condition is False or isinstance(condition, np.bool_):
        return this if condition else that
    return namespace(condition).where(condition, this, that)


def everywhere(condition: Any) -> Any:
    """`condition` of a float, or whether all of an array's hold: a bool for `if`."""
    if condition is True or condition is False:
        return condition
    return namespace(condition) is np and bool(condition.all())


def anywhere(condition: Any) -> Any:
    """Whether `condition` holds for the one, or for any of many."""
    if condition is True or condition is False:
        return condition
    return namespace(condition) is not np or bool(condition.any())


SMALL_ANGLE = 0.03  # [rad] below which a few terms of the series give sine and cosine
# of x², as many as it takes up to an eighth of half a turn
COSINE = [(-1) ** k / math.factorial(2 * k) for k in range(7)]
SINE = [(-1) ** k / math.factorial(2 * k + 1) for k in range(7)]


def rotated(heading: Any, cosine: Any, sine: Any, angle: Any) -> tuple[Any, Any, Any]:
    """Heading [rad], its cosine and its sine after a rotation by `angle` [rad]."""
    end = heading + angle
    if isinstance(end, float):
        return end, math.cos(end), math.sin(end)
    return end, *_rotate(heading, cosine, sine, angle)


def swept(
    heading: Any, cosine: Any, sine: Any, halfway: Any, angle: Any
) -> tuple[Any, Any, Any, Any, Any]:
    """Cosine and sine after rotating by `halfway` [rad]; heading, cosine and sine after `angle`."""
    end = heading + angle
    if isinstance(end, float):
        middle = heading + halfway
        return math.cos(middle), math.sin(middle), end, math.cos(end), math.sin(end)
    direction = _rotate(heading, cosine, sine, angle)
    return *_rotate(heading, cosine, sine, halfway), end, *direction


def _rotate(heading: Array, cosine: Array, sine: Array, angle: Array) -> tuple[Array, Array]:
    """Cosines and sines (N,) after rotating by `angle` (N,) [rad].

    Of small angles the series takes half as long as numpy's cosine and sine; what it leaves
    out is below 1e-16, and the length of (cosine, sine) wanders by that much in each rotation.
    Each result depends on its own angle only, not on those beside it.
    """
    square = angle * angle
    if namespace(square) is not np:
        return _rotate_any(cosine, sine, angle)
    largest = square.max(initial=0.0)
    if largest < SMALL_ANGLE * SMALL_ANGLE:
        return _by_series(cosine, sine, angle, square)
    end, small = heading + angle, square < SMALL_ANGLE * SMALL_ANGLE
    if not small.any():
        return np.cos(end), np.sin(end)
    c, s = _by_series(cosine, sine, angle, square)
    return np.where(small, c, np.cos(end)), np.where(small, s, np.sin(end))


def _rotate_any(cosine: Any, sine: Any, angle: Any) -> tuple[Any, Any]:
    """The same without a look at the values: the series of an eighth of the angle, doubled."""
    part = wrapped(angle) / 8
    square = part * part
    c, s = _polynomial(square, *COSINE), part * _polynomial(square, *SINE)
    for _ in range(3):
        c, s = 1 - 2 * s * s, 2 * s * c
    return c * cosine - s * sine, s * cosine + c * sine


def _by_series(cosine: Array, sine: Array, angle: Array, square: Array) -> tuple[Array, Array]:
    c = _polynomial(square, 1.0, -1 / 2, 1 / 24, -1 / 720)
    s = _polynomial(square, 1.0, -1 / 6, 1 / 120, -1 / 5040)
    s *= angle
    return c * cosine - s * sine, s * cosine + c * sine


def _polynomial(x: Array, *coefficients: float) -> Array:
    """c₀ + c₁ x + … + cₙ xⁿ, in place: numpy would ask for memory at every sum."""
    *others, last = coefficients
    value = last * x
    for coefficient in others[:0:-1]:
        value += coefficient
        value *= x
    value += others[0]
    return value


def compose(f: Derivatives, inner: tuple[Any, Any, Any]) -> Derivatives:
    """Derivatives by t of f(s(t)), orders 0 to 3, from those of f by s, and ṡ, s̈, s⃛."""
    s_1, s_2, s_3 = inner
    _, f_1, f_2, f_3 = f
    return (
        f[0],
        f_1 * s_1,
        f_2 * s_1**2 + f_1 * s_2,
        f_3 * s_1**3 + 3 * f_2 * s_1 * s_2 + f_1 * s_3,
    )


def turned(now: float, before: float, time: float) -> float:
    """Turn of a wheel [rad] within a time [s] between two angles [rad], each turn perhaps anew.

    Those that begin anew are within a turn of 0: there, 3/4 of a turn and more within `AT_ONCE`
    [s] are taken for a new beginning. Angles that go on are beyond, and as they are.
    """
    turn, farthest = now - before, max(abs(now), abs(before))
    begins = farthest <= FULL_TURN + ROUNDING and abs(turn) > 0.75 * FULL_TURN
    if begins and time < AT_ONCE:
        turn -= math.copysign(FULL_TURN, turn)
    return turn
