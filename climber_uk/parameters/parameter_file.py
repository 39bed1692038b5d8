"""Parameter files and `name:=value` arguments, read as a node would read them; no ROS needed.

As in rcl, numbers and truth values are those of C, not those of YAML 1.2.
"""

import dataclasses
import math
import re
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml

from climber_uk.parameters.declaration import QOS
from climber_uk.parameters.text_file import at_home, text_of

T = TypeVar("T")
PARAMETERS = "ros__parameters"
FILE = "file"  # last part of a parameter that names a file, relative to the parameter file
PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
TEXT, QUOTED = "tag:yaml.org,2002:str", ("'", '"')
TRUE = {"y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"}
FALSE = {"n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"}
INTEGER = re.compile(r"[-+]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
HEXADECIMAL = re.compile(
    r"[-+]?0x([\da-f]+\.?[\da-f]*|\.[\da-f]+)(p[-+]?\d+)?", re.IGNORECASE | re.ASCII
)
SPECIAL = re.compile(r"[-+]?(\.?(inf|nan)|infinity)", re.IGNORECASE)
FLOAT = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
ZERO = re.compile(r"[-+]?[0.]+(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
LEAST = sys.float_info.min
DEEPEST = 100  # tables
MOST = 10_000  # values; rcl takes a time that grows with their square
NODE_NAME = re.compile(r"/?(\*{1,2}|[a-z_]\w*)(/(\*{1,2}|[a-z_]\w*))*", re.IGNORECASE | re.ASCII)
NO_ALIAS = "an alias (*) is not taken"


@dataclass(frozen=True)
class Values:
    """Values of parameters by name; those that are missing have their defaults."""

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
    """Values for the nodes of a name, in which * matches one part, ** any number of parts."""

    name: str
    values: dict[str, Any]

    @cached_property
    def is_shared(self) -> bool:
        """Whether nodes of any name are meant: not each of them has all of these parameters.

        `/**/x` means x, wherever it is: what x does not have can only be a mistake there.
        """
        return self.name.endswith("*")

    def is_for(self, node: str) -> bool:
        """Whether it is for a node of this full name."""
        parts = [part for part in self.name.split("/") if part]
        said = {"**": "(/[^/]+)*", "*": "/[^/]+"}
        return bool(re.fullmatch("".join(said.get(p, "/" + re.escape(p)) for p in parts), node))


class GivenValue(NamedTuple):
    """A value, and whether it is from a section for nodes of any name."""

    value: Any
    is_shared: bool


def read_sections(path: Path) -> list[Section]:
    """Sections of a parameter file; `OSError`, or `ValueError` of one line, if it is none."""
    found: dict[str, Section] = {}
    for number, (keys, value) in enumerate(_entries(path)):
        if number == MOST:
            raise ValueError(f"{path} has more than {MOST} values")
        if PARAMETERS not in keys:
            hint = " (with two underscores)" * ("ros_parameters" in keys)
            raise ValueError(
                f"{path} is no parameter file: {'/'.join(keys)} is not in {PARAMETERS}{hint}"
            )
        own = keys.index(PARAMETERS)
        name = "/".join(keys[:own])
        if not name:
            raise ValueError(f"{path} is no parameter file: no node's name before {PARAMETERS}")
        if not NODE_NAME.fullmatch(name):
            raise ValueError(f"{path} is no parameter file: {name!r} cannot be a node's name")
        if own == len(keys) - 1:
            raise ValueError(
                f"{path} is no parameter file: {PARAMETERS} of {name} is {value!r}, no table: "
                "is a blank missing after a colon?"
            )
        section = found.setdefault(name, Section(name, {}))
        parameter = ".".join(keys[own + 1 :])
        if parameter in section.values:
            raise ValueError(f"{path} has {parameter} of {name} twice")
        if keys[-1].split(".")[-1] == FILE and isinstance(value, str) and value:
            value = str(path.parent / at_home(value))
        section.values[parameter] = value
    return list(found.values())


def read_file(path: Path, node: str, known: Collection[str] = ()) -> dict[str, Any]:
    """Values of a parameter file for a node, by name; of two entries the later one counts.

    `node` is the full name. Raises `ValueError` if the file has none for it, or, where any are
    `known`, none of those, or another: it is misspelt. Values that name a file are relative to
    the working directory, not to the parameter file.
    """
    sections = read_sections(path)
    found = given(sections, node)
    if not found:
        raise ValueError(nothing_for(node, path, sections))
    if known and not found.keys() & set(known) and all(of.is_shared for of in found.values()):
        raise ValueError(f"{path} has no parameters for {node} but {', '.join(found)}")
    own = (name for name, (_, is_shared) in found.items() if not is_shared)
    refuse_unknown(own if known else (), known, node)
    return {name: value for name, (value, _) in found.items()}


def refuse_unknown(names: Iterable[str], known: Collection[str], node: str) -> None:
    """Raise `ValueError` if one of `names` is not `known`: it is misspelt."""
    for name in names:
        if name not in known and not name.startswith(QOS):
            raise ValueError(f"{name} is no parameter of {node}{similar(name, known)}")


def given(sections: Iterable[Section], node: str) -> dict[str, GivenValue]:
    """What sections have for a node, of two entries the later one's."""
    found: dict[str, GivenValue] = {}
    for section in sections:
        for name, value in section.values.items() if section.is_for(node) else ():
            is_shared = section.is_shared and (name not in found or found[name].is_shared)
            found[name] = GivenValue(value, is_shared)
    return found


def similar(name: str, known: Iterable[str]) -> str:
    """' (did you mean …?)' with the most similar of `known`; empty if none is similar."""
    from difflib import get_close_matches  # only where something is wrong

    matches = get_close_matches(name, list(known), n=1)
    return f" (did you mean {matches[0]}?)" if matches else ""


def nothing_for(node: str, path: Path, sections: Iterable[Section]) -> str:
    """Message that a file has no parameters for a node, and for which ones it has."""
    names = ", ".join(section.name for section in sections) or "no node"
    return f"{path} has no parameters for {node}, but for {names}"


def read_argument(argument: str) -> tuple[str, Any]:
    """Name and value of an argument `name:=value`; `ValueError` if it is none."""
    name, separator, value = argument.partition(":=")
    if not (name and separator and value):
        raise ValueError(f"{argument!r} must be name:=value")
    try:
        return name, load(value)
    except yaml.YAMLError:
        return name, value


def load(text: str) -> Any:
    """Content of a YAML text, its plain scalars as rcl takes them.

    Raises `YAMLError`, also for a name that a table has twice, and for an alias.
    """
    try:
        return yaml.load(text, _Loader)
    except yaml.YAMLError:
        raise
    except Exception as error:  # of many kinds: too deep, or a tag that does not fit
        raise yaml.YAMLError(f"not to be read: {error}") from None


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

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):  # a few of which can stand for any amount of memory
            raise yaml.composer.ComposerError(None, None, NO_ALIAS, self.peek_event().start_mark)
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        found = super().construct_mapping(node, deep)
        if len(found) < len(node.value):
            said = f"one of {', '.join(map(str, found))} is there twice"
            raise yaml.constructor.ConstructorError(None, None, said, node.start_mark)
        return found

    def construct_yaml_str(self, node: yaml.ScalarNode) -> Any:
        return _value(node.value, node.style) if node.value or node.style else None


_Loader.add_constructor(TEXT, _Loader.construct_yaml_str)


def _value(text: str, style: str | None) -> bool | int | float | str:
    """Value of a scalar: quoted ones are strings."""
    return text if style in QUOTED else scalar(text)


def _entries(path: Path) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Keys and value of each entry of a file, in its order."""
    tables, line = _Tables(), 1
    try:
        text = text_of(path)
    except ValueError as error:
        raise ValueError(f"{path} is no parameter file: {error}") from None
    try:
        for event in yaml.parse(text, PARSER):
            line = event.start_mark.line + 1  # type: ignore[union-attr]
            if isinstance(event, yaml.DocumentStartEvent) and event.version == (1, 2):
                raise ValueError("rcl reads YAML 1.1: leave %YAML out")
            for value in tables.take(event):
                yield tuple(tables.keys), value
                tables.keys[-1] = ""
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is no parameter file: {_in_words(error, text)}") from None
    except ValueError as error:
        raise ValueError(f"{path} is no parameter file: line {line}: {error}") from None


def _in_words(error: yaml.YAMLError, text: str) -> str:
    """What is wrong with a YAML text, and where; of tabs in plain words."""
    if not isinstance(error, yaml.MarkedYAMLError) or (mark := error.problem_mark) is None:
        return " ".join(str(error).split())
    said = " ".join(f"{error.context or ''} {error.problem or ''}".split())
    before = text.split("\n")[mark.line : mark.line + 1]
    if before and "\t" in before[0][: mark.column + 1]:
        said = "a tab, where YAML takes blanks only"
    return f"line {mark.line + 1}, column {mark.column + 1}: {said}"


class _Tables:
    """Keys of the tables around YAML's events: as strict as rcl, and without recursion."""

    def __init__(self) -> None:
        self.keys: list[str] = []  # of the tables that are open; '' where a key is to come
        self.sequence: list[Any] | None = None  # that is open

    def take(self, event: yaml.Event) -> Iterator[Any]:
        """Take in an event; yield the value that it completes, if any, whose keys are `keys`."""
        if isinstance(event, yaml.ScalarEvent):
            yield from self._take_scalar(event)
        elif isinstance(event, yaml.MappingStartEvent):
            self._expect_value()
            self.keys.append("")
            if len(self.keys) > DEEPEST:
                raise ValueError(f"more than {DEEPEST} tables in each other")
        elif isinstance(event, yaml.MappingEndEvent):
            self.keys.pop()
            self.keys[-1:] = [""] * bool(self.keys)
        elif isinstance(event, yaml.SequenceStartEvent):
            self._expect_value()
            self.sequence = []
        elif isinstance(event, yaml.SequenceEndEvent):
            if len({type(value) for value in self.sequence or ()}) > 1:
                raise ValueError(
                    f"{self.keys[-1]}={self.sequence} must have values of one type (5.0, not 5, "
                    "among numbers with a point)"
                )
            yield self.sequence
            self.sequence = None
        elif isinstance(event, yaml.AliasEvent):
            raise ValueError(NO_ALIAS)

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
            if len(self.sequence) > MOST:
                raise ValueError(f"{self.keys[-1]} has more than {MOST} values")

    def _expect_value(self) -> None:
        if self.sequence is not None or (self.keys and not self.keys[-1]):
            raise ValueError("a table or a list where none can be")
