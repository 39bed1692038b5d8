"""Paths in parameter files: relative to the parameter file, not to the working directory."""

from collections.abc import Sequence

from climber_uk.parameters.parameter_files import paths
from climber_uk.parameters.text_file import at_home


def located(path: str, name: str, node: str, arguments: Sequence[str]) -> str:
    """`path`, the value of parameter `name` of `node`, relative to the working directory.

    It was relative to the last of the `arguments`' parameter files that gives the parameter;
    a path from the command line stays as it is, and so does one that `read_file` has located.
    """
    given = at_home(path)
    if given.is_absolute():
        return path
    # with yaml, which is slow to import
    from climber_uk.parameters.parameter_file import FILE, read_file

    found = path
    for file in paths(arguments):
        try:
            values = read_file(file, node)
        except (OSError, ValueError):  # not a file for this node
            continue
        beside, is_relative = str(file.parent / path), name.split(".")[-1] == FILE
        if values.get(name) == (beside if is_relative else path):
            found = beside
    return found
