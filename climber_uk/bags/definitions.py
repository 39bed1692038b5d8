"""Types of messages as a bag defines them, within the sizes that messages have."""

from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from climber_uk.bags.storage import TYPESTORE

MOST_KEPT = 50  # definitions that the next bag needs not be read anew for
LONGEST = 2**16  # [characters] of a definition that is read
MOST_FIELDS = 10_000  # of a message, with those of the types it contains
LONGEST_ARRAY = 2**20  # numbers, of a length that a type fixes


def known(name: str) -> Typestore | None:
    """Return Jazzy's store of types if the type is in it, else None."""
    return TYPESTORE if name in TYPESTORE.fielddefs else None


@lru_cache(MOST_KEPT)
def defined(name: str, definition: str) -> Typestore:
    """Return a store with the type of a definition; raises `ValueError` if it is not sound."""
    try:
        types = get_types_from_msg(definition, name)
        _count(types, name, ())
        store = get_typestore(Stores.EMPTY)
        store.register(types)
        store.get_msgdef(name)
    except ValueError:
        raise
    except Exception:  # a hostile definition can make its parser raise anything
        raise ValueError("it cannot be parsed") from None
    return store


def _count(types: Any, name: str, within: tuple[str, ...]) -> int:
    """How many fields a type has; raises `ValueError` of too many, and of a type in itself."""
    if name in within:
        raise ValueError(f"{name} contains itself")
    if name not in types:
        raise ValueError(f"it does not define {name}")
    count = 0
    for _, (kind, what) in types[name][1]:
        times = 1
        if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            (kind, what), length = what
            is_numbers = kind == Nodetype.BASE and what[0] not in ("string", "wstring")
            times = 1 if is_numbers or not length else length
            if length > LONGEST_ARRAY:
                raise ValueError(f"an array of {length}")
        inner = _count(types, what, (*within, name)) if kind == Nodetype.NAME else 1
        count += times * max(1, inner)
        if count > MOST_FIELDS:
            raise ValueError(f"more than {MOST_FIELDS} fields")
    return count
