"""The example of docs/extending.md as an installed package, on a path of its own."""

import re
import tomllib
from pathlib import Path

TEXT = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()


def block(language):
    """The first block of code of the document in a language."""
    return re.search(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)[1]


def install(directory, more=None):
    """Put the package there, as pip would, with `more` entry points by group and name."""
    groups = tomllib.loads(block("toml"))["project"]["entry-points"]
    for group, entries in (more or {}).items():
        groups[group] = groups.get(group, {}) | entries
    about = directory / "my_climber-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my-climber\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "\n".join(
            "\n".join([f"[{group}]", *(f"{name} = {value}" for name, value in entries.items())])
            for group, entries in groups.items()
        )
    )
    (directory / "my_climber.py").write_text(block("python"))
    return groups
