"""Parameters as a node would get them, from a parameter file or from name:=value; no ROS needed."""

import dataclasses
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

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


@dataclass(frozen=True)
class Values:
    """Parameters by name; those that are not there have their defaults."""

    by_name: Mapping[str, Any]

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Instance of `kind`; raises `ValueError` naming parameter, value and bound."""
        names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
        given = {
            name: self.by_name[prefix + name] for name in names if prefix + name in self.by_name
        }
        try:
            return kind(**given)
        except ValueError as error:
            raise ValueError(f"{prefix}{error}") from None


def read_file(path: Path, node: str) -> dict[str, Any]:
    """Values that a parameter file has for a node, of two entries the later one's.

    `node` is the full name, which the file may give with wildcards; `ValueError` if it does not.
    What names a file is as seen from the working directory, not from the parameter file.
    """
    try:
        tree = yaml.safe_load(path.read_text())
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is no parameter file: {' '.join(str(error).split())}") from None
    found: dict[str, Any] = {}
    for keys, value in _leaves(tree):
        if OWN in keys:
            own = keys.index(OWN)
            if re.fullmatch(_pattern("/".join(keys[:own])), node):
                name = ".".join(keys[own + 1 :])
                is_path = name in PATHS and isinstance(value, str) and value
                found[name] = str(path.parent / Path(value).expanduser()) if is_path else value
    if not found:
        raise ValueError(f"{path} has no parameters for {node}")
    return found


def read_argument(argument: str) -> tuple[str, Any]:
    """Name and value of `name:=value`."""
    name, separator, value = argument.partition(":=")
    if not (name and separator and value):
        raise ValueError(f"{argument!r} must be name:=value")
    try:
        return name, yaml.safe_load(value)
    except yaml.YAMLError:
        return name, value


def _leaves(tree: Any, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if not isinstance(tree, dict):
        yield above, tree
        return
    for key, below in tree.items():
        yield from _leaves(below, (*above, str(key)))


def _pattern(name: str) -> str:
    """Regular expression of a node's name, in which * is one part and ** are any."""
    parts = [part for part in name.split("/") if part]
    return "".join({"**": "(/[^/]+)*", "*": "/[^/]+"}.get(p, "/" + re.escape(p)) for p in parts)
