"""Variants by name: a package's own, and those that other packages add as entry points.

docs/extending.md shows how another package does that.
"""

import dataclasses
import logging
import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from functools import cache, cached_property
from typing import Any, TypeVar

T = TypeVar("T")  # the type of a class
PREFIX = "climber_uk."


class Variants(Mapping[str, T]):
    """Dataclasses of parameters: `own` by name, and then the entry points `climber_uk.<group>`.

    Those are loaded when they are first asked for, as they import what they derive from. One that
    cannot be had is left out, and the log has a line with its name and what is wrong.
    """

    def __init__(self, own: Mapping[str, T], group: str) -> None:
        self._own, self._group = own, group

    def __getitem__(self, name: str) -> T:
        return self._all[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    @cached_property
    def _all(self) -> dict[str, T]:
        found = dict(self._own)
        for entry in _others(PREFIX + self._group):
            try:
                if not entry.name.isidentifier() or entry.name in found:
                    raise ValueError(
                        "its name must be letters, digits and _, and another one than theirs"
                    )
                found[entry.name] = _checked(entry.load())
            except Exception as error:  # whatever the code of others raises
                said = f"{type(error).__name__}: {error}".split("\n")[0]
                name = f"{self._group} {entry.name!r} ({entry.value})"
                logging.getLogger("climber_uk").warning("%s is left out: %s", name, said)
        return found


def _checked(kind: Any) -> Any:
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise TypeError("it must be a dataclass")
    if bare := [field.name for field in dataclasses.fields(kind) if not field.metadata]:
        raise TypeError(f"fields must be made by `parameter`: {', '.join(bare)}")
    return kind


def _others(group: str) -> Collection[Any]:
    """Entry points of a group: `importlib.metadata` takes 40 ms to say that there are none."""
    if not _are_there_any():
        return ()
    from importlib.metadata import entry_points

    return entry_points(group=group)


@cache
def _are_there_any() -> bool:
    """Whether an installed package has entry points for this one; takes 2 ms."""
    for place in sys.path:
        with suppress(OSError), os.scandir(place or ".") as items:
            for item in items:
                if item.name.endswith("-info") and _names_us(f"{item.path}/entry_points.txt"):
                    return True
    return False


def _names_us(file: str) -> bool:
    with suppress(OSError), open(file, "rb") as text:
        return f"[{PREFIX}".encode() in text.read()
    return False
