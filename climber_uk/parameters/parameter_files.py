"""The parameter files among a process's arguments, and what they have for one of its nodes."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any


class ParameterFiles:
    """Values that files give a node; raises `OSError` or `ValueError` if one cannot be read."""

    def __init__(self, arguments: Sequence[str], node: str) -> None:
        self.node, self.names = node, list[str]()
        self.given: dict[str, Any] = {}  # see `parameter_file.GivenValue`
        self.sources: dict[str, str] = {}  # name of the file, by the parameter's
        self.idle: list[str] = []  # a line for each file that has nothing for the node
        for path in paths(arguments):
            from climber_uk.parameters import (
                parameter_file,  # where there is no file: no need of it
            )

            if path.exists() and not (path.is_file() or path.is_dir()):
                raise ValueError(f"{path} is no regular file, and a node reads it more than once")
            sections = parameter_file.read_sections(path)
            given = parameter_file.given(sections, node)
            self.names.append(str(path))
            self.given |= given
            self.sources |= dict.fromkeys(given, str(path))
            if not given:
                self.idle.append(parameter_file.nothing_for(node, path, sections))

    def is_shared(self, name: str) -> bool:
        """Whether a parameter is given by a section for nodes of any name."""
        return name in self.given and self.given[name].is_shared

    def has_nothing_of(self, names: Iterable[str]) -> bool:
        """Whether there are files, but none of these parameters in them."""
        return bool(self.names) and not self.given.keys() & set(names)

    @property
    def emptiness(self) -> str:
        """Message that the files have no parameter that the node needs."""
        if self.idle:
            return self.idle[0]
        has = ", ".join(self.given)
        return f"{', '.join(self.names)} has no parameters for {self.node} but {has}"

    def named(self, names: Iterable[str]) -> str:
        """Files (or 'command line') that give some parameters, for the log."""
        return ", ".join(dict.fromkeys(self.sources.get(n, "command line") for n in names))


def paths(arguments: Sequence[str]) -> Iterator[Path]:
    """Parameter files among arguments: each after --params-file, from `--ros-args` to `--`.

    Raises `ValueError` if there is none after it.
    """
    is_for_ros = False
    for word, after in pairwise([*arguments, ""]):
        is_for_ros = (is_for_ros or word == "--ros-args") and word != "--"
        if is_for_ros and word == "--params-file":
            if not after:
                raise ValueError(f"{word} wants a file")
            yield Path(after)
