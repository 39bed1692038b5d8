"""Numbers read from, and written into, the bytes of serialised messages.

To deserialise an Odometry takes much longer than to read its ten numbers where they stand
(`python bench/messages.py --reading`). The places are those of a `Layout`, which is found once and
holds as long as the strings and lengths of the messages stay the same. What has no layout is read
by rclpy.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import cache
from importlib import import_module
from operator import attrgetter
from typing import Any, Generic, TypeVar

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser import definition

from climber_uk.messages.cdr_layout import ARRAY, BASE, NAME, SEQUENCE, Layout

MOST_PARTS = 2000  # of a message whose layout is looked for
MOST_LAYOUTS = 16  # that are looked for: it takes longer than to deserialise a message
NUMBERS = {"double": "float64", "float": "float32", "boolean": "bool", "octet": "byte"}

Found = TypeVar("Found")


class Layouts(Generic[Found]):
    """What `find` makes of the layouts of one type's messages; they are few, and remembered."""

    def __init__(self, kind: type, find: Callable[[Layout], Found]) -> None:
        self.kind, self.find = kind, find
        # by size: their contents, and the bytes that those messages have in common, with their ends
        self._known: dict[int, tuple[Found, list[tuple[int, int, bytes]]]] = {}
        self._left = MOST_LAYOUTS  # to be looked for

    def of(self, data: bytes) -> Found | None:
        """Contents of messages with the strings and lengths of `data`; None: deserialise."""
        known = self._known.get(len(data))
        if known is not None and all(data[i:j] == fixed for i, j, fixed in known[1]):
            return known[0]
        if self._left == 0:
            return None
        self._left -= 1
        try:
            layout = laid_out(data, self.kind)
            contents = self.find(layout)
        except (ValueError, LookupError):
            return None
        self._known[len(data)] = contents, [(i, j, data[i:j]) for i, j in layout.spans]
        return contents

    def deserialized(self, data: bytes) -> Any:
        """The message, by rclpy; `ValueError` if it is none."""
        try:
            return deserialize_message(data, self.kind)
        except Exception as error:  # of several kinds, by what is wrong, and by the middleware
            raise ValueError(f"not a serialised {self.kind.__name__}: {error}") from None


class NumberReader:
    """Reads numbers and strings of messages of one type, at paths such as `pose.pose.position.x`.

    A string's path may be that of a sequence of strings.
    """

    def __init__(self, kind: type, numbers: Sequence[str], strings: Sequence[str] = ()) -> None:
        self._numbers, self._strings = numbers, strings
        self._of_message = attrgetter(*numbers, *strings)
        self._layouts = Layouts(kind, self._contents)

    def __call__(self, data: bytes) -> tuple[Any, ...]:
        """Numbers, then strings, in the order of their paths; `ValueError` if it is no message."""
        contents = self._layouts.of(data)
        if contents is None:
            return self._of_message(self._layouts.deserialized(data))
        row, texts = contents
        numbers: tuple[Any, ...] = np.frombuffer(data, row).tolist()[0]
        return numbers + texts

    def _contents(self, layout: Layout) -> tuple[Any, tuple[str | list[str], ...]]:
        """Numbers as one type, and the strings; `KeyError` if there is no such path."""
        return layout.chosen(self._numbers), tuple(_texts(layout, at) for at in self._strings)


class NumberWriter:
    """Writes numbers at some paths into the bytes of a message, which else stays as it is."""

    def __init__(self, message: Any, numbers: Iterable[str]) -> None:
        self._data, layout = serialized(message)
        self._row = np.frombuffer(self._data, layout.chosen(numbers))

    def __call__(self, *numbers: Any) -> bytes:
        """The serialised message with these numbers, in the order of their paths."""
        self._row[0] = numbers
        return bytes(self._data)


def serialized(message: Any) -> tuple[bytearray, Layout]:
    """A message's bytes, without those that rclpy may leave behind its end, and their layout."""
    data = serialize_message(message)
    layout = laid_out(data, type(message))
    layout.data = data[: layout.place]
    return bytearray(layout.data), layout


def laid_out(data: bytes, kind: type) -> Layout:
    """Layout of a serialised message of a type; `ValueError` if there is none."""
    layout = Layout(data, fields_of, most_parts=MOST_PARTS)
    layout.walk(type_name(kind))
    return layout


def type_name(kind: type) -> str:
    """Full name of a message's type, such as `nav_msgs/msg/Odometry`."""
    package, *_ = kind.__module__.split(".")
    return f"{package}/msg/{kind.__name__}"


@cache
def fields_of(name: str) -> list[tuple[str, Any]]:
    """Names and descriptions of the fields of a message's type, as `Layout` takes them."""
    package, _, kind = name.split("/")
    message: Any = getattr(import_module(f"{package}.msg"), kind)
    names = message.get_fields_and_field_types()
    return [
        (field, _described(slot)) for field, slot in zip(names, message.SLOT_TYPES, strict=True)
    ]


def _described(slot: Any) -> tuple[int, Any]:
    if isinstance(slot, definition.NamespacedType):
        return NAME, "/".join(slot.namespaced_name())
    if isinstance(slot, definition.Array):
        return ARRAY, (_described(slot.value_type), slot.size)
    if isinstance(slot, definition.AbstractSequence):
        return SEQUENCE, (_described(slot.value_type), 0)
    if isinstance(slot, definition.AbstractString):
        return BASE, ("string", 0)
    return BASE, (NUMBERS.get(slot.typename, slot.typename), 0)


def _texts(layout: Layout, path: str) -> str | list[str]:
    """The string at a path, or those of a sequence; `KeyError` if there are none."""
    if path in layout.lengths:
        return [layout.strings[f"{path}.{i}"] for i in range(layout.lengths[path])]
    return layout.strings[path]
