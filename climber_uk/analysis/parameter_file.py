"""Parameters as a node would get them, from a parameter file or from name:=value; no ROS needed.

Files are read as rcl reads them: with numbers and truths of C, not those of YAML 1.2.
"""

import dataclasses
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml

from climber_uk.mechanics.plan import KINDS

T = TypeVar("T")
OWN = "ros__parameters"
# parameters that name a file: relative to the parameter file
PATHS = {
    prefix + field.name
    for kind, prefix in KINDS
    for field in dataclasses.fields(kind)
    if field.metadata.get("is_path")
}
PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
TEXT, QUOTED = "tag:yaml.org,2002:str", ("'", '"')
TRUE = {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
FALSE = {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
HEXADECIMAL = re.compile(r"[-+]?0x([\da-f]+\.?[\da-f]*|\.[\da-f]+)(p[-+]?\d+)?", re.IGNORECASE)
SPECIAL = re.compile(r"[-+]?(\.?(inf|nan)|infinity)", re.IGNORECASE)
FLOAT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)
ZERO = re.compile(r"[-+]?[0.]+(e[-+]?\d+)?", re.IGNORECASE)
LEAST = sys.float_info.min
LARGEST = 2**24  # [bytes] of a file


@dataclass(frozen=True)
class Values:
    """Parameters by name; those that are not there have their defaults."""

    by_name: Mapping[str, Any]

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Instance of `kind`; raises `ValueError` naming parameter, value and bound."""
        given = {
            field.name: self.by_name[prefix + name]
            for field in dataclasses.fields(kind)  # type: ignore[arg-type]
            for name in (field.metadata.get("formerly"), field.name)
            if name and prefix + name in self.by_name
        }
        try:
            return kind(**given)
        except ValueError as error:
            raise ValueError(f"{prefix}{error}") from None


@dataclass(frozen=True)
class Section:
    """Values that a file gives the nodes of a name, in which * is one part and ** are any."""

    name: str
    values: dict[str, Any]

    @cached_property
    def is_shared(self) -> bool:
        """Whether nodes of any name are meant: not each of them has all of these parameters.

        `/**/x` means x, wherever it is: what x does not have can only be a mistake there.
        """
        return self.name.endswith("*")

    def is_for(self, node: str) -> bool:
        """Whether a node of this full name is meant."""
        parts = [part for part in self.name.split("/") if part]
        said = {"**": "(/[^/]+)*", "*": "/[^/]+"}
        return bool(re.fullmatch("".join(said.get(p, "/" + re.escape(p)) for p in parts), node))


class Given(NamedTuple):
    """A value, and whether it is given to nodes of any name, and never to one by its name."""

    value: Any
    is_shared: bool


def read_sections(path: Path) -> list[Section]:
    """All that a parameter file has; `OSError`, or `ValueError` of one line, if it is none."""
    found: dict[str, Section] = {}
    for keys, value in _entries(path):
        if OWN not in keys:
            raise ValueError(f"{path} is no parameter file: {'/'.join(keys)} is not in {OWN}")
        own = keys.index(OWN)
        name = "/".join(keys[:own])
        section = found.setdefault(name, Section(name, {}))
        parameter = ".".join(keys[own + 1 :])
        if parameter in section.values:
            raise ValueError(f"{path} has {parameter} of {name} twice")
        if parameter in PATHS and isinstance(value, str) and value:
            value = str(path.parent / Path(value).expanduser())
        section.values[parameter] = value
    return list(found.values())


def read_file(path: Path, node: str) -> dict[str, Any]:
    """Values that a parameter file has for a node, of two entries the later one's.

    `node` is the full name, which the file may give with wildcards; `ValueError` if it does not.
    What names a file is as seen from the working directory, not from the parameter file.
    """
    sections = read_sections(path)
    found = given(sections, node)
    if not found:
        raise ValueError(nothing_for(node, path, sections))
    return {name: value for name, (value, _) in found.items()}


def given(sections: Iterable[Section], node: str) -> dict[str, Given]:
    """What sections have for a node, of two entries the later one's."""
    found: dict[str, Given] = {}
    for section in sections:
        for name, value in section.values.items() if section.is_for(node) else ():
            is_shared = section.is_shared and (name not in found or found[name].is_shared)
            found[name] = Given(value, is_shared)
    return found


def similar(name: str, known: Iterable[str]) -> str:
    """Question whether another name was meant, in brackets; empty if none is like it."""
    from difflib import get_close_matches  # only where something is wrong

    matches = get_close_matches(name, list(known), n=1)
    return f" (did you mean {matches[0]}?)" if matches else ""


def nothing_for(node: str, path: Path, sections: Iterable[Section]) -> str:
    """Line that says so, and what else the file has."""
    names = ", ".join(section.name for section in sections) or "no node"
    return f"{path} has no parameters for {node}, but for {names}"


def read_argument(argument: str) -> tuple[str, Any]:
    """Name and value of `name:=value`."""
    name, separator, value = argument.partition(":=")
    if not (name and separator and value):
        raise ValueError(f"{argument!r} must be name:=value")
    try:
        return name, load(value)
    except yaml.YAMLError:
        return name, value


def load(text: str) -> Any:
    """What YAML says, its plain scalars as rcl takes them; raises `YAMLError`."""
    return yaml.load(text, _Loader)


def scalar(text: str) -> bool | int | float | str:
    """Value of a plain scalar as rcl takes it: by C's `strtoll` and `strtod`."""
    if text in TRUE or text in FALSE:
        return text in TRUE
    if INTEGER.fullmatch(text):
        digits = text.lstrip("+-")
        octal = digits.startswith("0") and digits.isdigit()
        number = int(text, 8 if octal else 0)
        return number if -(2**63) <= number < 2**63 else float(number)
    if HEXADECIMAL.fullmatch(text):
        return float.fromhex(text)
    if SPECIAL.fullmatch(text):
        return float(text.replace(".", ""))
    # C gives up where there is no normal number: above the largest, and below the least
    if FLOAT.fullmatch(text) and (ZERO.fullmatch(text) or LEAST <= abs(float(text)) < math.inf):
        return float(text)
    return text


class _Loader(yaml.SafeLoader):
    yaml_implicit_resolvers = {}  # noqa: RUF012 - as yaml has it

    def construct_yaml_str(self, node: yaml.ScalarNode) -> Any:
        return _value(node.value, node.style) if node.value or node.style else None


_Loader.add_constructor(TEXT, _Loader.construct_yaml_str)


def _value(text: str, style: str | None) -> bool | int | float | str:
    return text if style in QUOTED else scalar(text)


def _entries(path: Path) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Keys and value of each entry of a file, in its order."""
    tables, line = _Tables(), 1
    try:
        for event in yaml.parse(_text(path), PARSER):
            line = event.start_mark.line + 1  # type: ignore[union-attr]
            for value in tables.take(event):
                yield tuple(tables.keys), value
                tables.keys[-1] = ""
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is no parameter file: {' '.join(str(error).split())}") from None
    except ValueError as error:
        raise ValueError(f"{path} is no parameter file: line {line}: {error}") from None


def _text(path: Path) -> str:
    with path.open("rb") as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise ValueError(f"larger than {LARGEST >> 20} MiB")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError("not a text in UTF-8") from None


class _Tables:
    """Where an event of YAML is in its tables: as strict as rcl is, and without recursion."""

    def __init__(self) -> None:
        self.keys: list[str] = []  # of the tables that are open; '' where a key is to come
        self.sequence: list[Any] | None = None  # that is open

    def take(self, event: yaml.Event) -> Iterator[Any]:
        """Go on by an event; yield the value that it completes, whose keys are `keys`."""
        if isinstance(event, yaml.ScalarEvent):
            yield from self._take_scalar(event)
        elif isinstance(event, yaml.MappingStartEvent):
            self._expect_value()
            self.keys.append("")
        elif isinstance(event, yaml.MappingEndEvent):
            self.keys.pop()
            self.keys[-1:] = [""] * bool(self.keys)
        elif isinstance(event, yaml.SequenceStartEvent):
            self._expect_value()
            self.sequence = []
        elif isinstance(event, yaml.SequenceEndEvent):
            yield self.sequence
            self.sequence = None
        elif isinstance(event, yaml.AliasEvent):
            raise ValueError("no node takes an alias (*)")

    def _take_scalar(self, event: yaml.ScalarEvent) -> Iterator[Any]:
        if not self.keys:
            raise ValueError(f"{event.value!r} is no table")
        if not self.keys[-1]:
            self.keys[-1] = event.value
            return
        if not (event.value or event.style in QUOTED):
            raise ValueError(f"{self.keys[-1]} has no value")
        value = event.value if event.tag == TEXT else _value(event.value, event.style)
        if self.sequence is None:
            yield value
        else:
            self.sequence.append(value)

    def _expect_value(self) -> None:
        if self.sequence is not None or (self.keys and not self.keys[-1]):
            raise ValueError("a table or a list where none can be")
