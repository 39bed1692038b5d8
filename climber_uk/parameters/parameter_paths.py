"""Paths in parameter files: relative to the parameter file, not to the working directory."""

from collections.abc import Sequence
from pathlib import Path

from climber_uk.parameters.parameter_files import paths


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
    for file in paths(arguments):
        try:
            values = read_file(file, node)
        except (OSError, ValueError):  # not a file for this node
            continue
        if values.get(name) in (path, str(file.parent / path)):
            found = str(file.parent / path)
    return found
