"""Tuples and dataclasses of many climbers: arrays (N,) where one climber has floats."""

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from climber_uk.mechanics import namespace


def indexed(of: Any, index: Any) -> Any:
    """`of` with `[index]` of every array in it: see `mapped`."""
    return mapped(lambda array: array[index], of)


def mapped(function: Callable[[Any], Any], of: Any) -> Any:
    """`of` with `function` of every array in it; goes into tuples and dataclasses.

    What holds no array comes back as the object that it is. Nothing is checked again.
    """
    if _is_array(of):
        return function(of)
    if isinstance(of, tuple):
        elements = (mapped(function, each) for each in of)
        return type(of)(*elements) if hasattr(of, "_fields") else tuple(elements)
    if dataclasses.is_dataclass(of) and not isinstance(of, type):
        before = {field.name: getattr(of, field.name) for field in dataclasses.fields(of)}
        after = {name: mapped(function, value) for name, value in before.items()}
        if all(after[name] is value for name, value in before.items()):
            return of
        changed = object.__new__(type(of))
        for name, value in after.items():
            object.__setattr__(changed, name, value)
        return changed
    return of


def amended(condition: Any, regular: Any, exceptional: Callable[..., Any], *arguments: Any) -> Any:
    """`exceptional(*arguments)` where `condition` holds, else `regular`: named tuples of numbers.

    `condition` is a bool or an array (N,) of them. `exceptional` is computed only for the climbers
    where it holds, from their elements of the arguments; `regular` is returned if there are none.
    JAX computes it for all, where it holds for any.
    """
    if not _is_array(condition):
        return exceptional(*arguments) if condition else regular
    if namespace(condition) is not np:
        from jax.lax import cond

        def mixed() -> Any:
            return chosen(condition, exceptional(*arguments), regular)

        return cond(condition.any(), mixed, lambda: chosen(condition, regular, regular))
    which = np.flatnonzero(condition)
    if not len(which):
        return regular
    instead = exceptional(*(indexed(argument, which) for argument in arguments))
    whole = []
    for numbers, replaced in zip(regular, instead, strict=True):
        numbers = np.array(np.broadcast_to(numbers, condition.shape))
        numbers[which] = replaced
        whole.append(numbers)
    return type(regular)(*whole)


def chosen(condition: Any, this: Any, that: Any) -> Any:
    """`select` for every number of two tuples, or two dataclasses, of one class."""
    if not _is_array(condition):
        return this if condition else that
    if isinstance(this, tuple):
        where = namespace(condition).where
        return type(this)(*(where(condition, *pair) for pair in zip(this, that, strict=True)))
    names = [field.name for field in dataclasses.fields(this)]
    pairs = {name: (getattr(this, name), getattr(that, name)) for name in names}
    differ = {name: pair for name, pair in pairs.items() if not np.array_equal(*pair)}
    changed = {name: np.where(condition, *pair) for name, pair in differ.items()}
    return dataclasses.replace(that, **changed)


def _is_array(of: Any) -> bool:
    return isinstance(of, np.ndarray) or namespace(of) is not np


@cache
def keep_what_is_freed() -> None:
    """Let glibc keep memory that a step frees for the next one, which halves its time.

    It gives back to the system whatever is freed at the end of its heap, but for twice as much as
    the largest block that was freed so far: one of 16 MB will do.
    """
    np.empty(2 << 20)
