"""Paths in parameter files: relative to the parameter file, not to the working directory."""

import itertools
from collections.abc import Sequence
from pathlib import Path


def located(path: str, name: str, node: str, arguments: Sequence[str]) -> str:
    """`path`, the value of parameter `name` of `node`, relative to the working directory.

    It was relative to the last of the `arguments`' parameter files that gives the parameter;
    a path from the command line stays as it is.
    """
    given = Path(path).expanduser()
    if given.is_absolute():
        return path
    from climber_uk.parameters.parameter_file import read_file  # with yaml, which is slow to import

    found = path
    for file in _parameter_files(arguments):
        try:
            values = read_file(file, node)
        except (OSError, ValueError):  # not a file for this node
            continue
        if values.get(name) in (path, str(file.parent / path)):
            found = str(file.parent / path)
    return found


def _parameter_files(arguments: Sequence[str]) -> list[Path]:
    pairs = itertools.pairwise(arguments)
    return [Path(file) for option, file in pairs if option == "--params-file"]
