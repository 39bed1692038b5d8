"""Parameter files written for nodes: a copy with some values changed, or given sections."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from climber_uk.parameters.parameter_file import PARAMETERS, TEXT, Section, read_sections, scalar
from climber_uk.parameters.text_file import write_whole


def write_changed(
    original: Path | None, changes: Mapping[str, Mapping[str, Any]], path: Path
) -> None:
    """Write a copy of `original`, if there is one, with changes by node and parameter.

    These stand in a section of their own at the end, so that they hold in every namespace.
    """
    tree = _tree(read_sections(original) if original else [])
    for node, values in changes.items():
        name = f"/**/{node}"
        section = tree.pop(name, {PARAMETERS: {}})
        for parameter, value in values.items():
            _set(section[PARAMETERS], parameter, value)
        tree[name] = section
    _write(tree, path)


def write_sections(sections: Iterable[Section], path: Path) -> None:
    """Write a parameter file of these sections."""
    _write(_tree(sections), path)


def _tree(sections: Iterable[Section]) -> dict[str, Any]:
    """Nested tables of YAML for sections."""
    tree: dict[str, Any] = {}
    for section in sections:
        for parameter, value in section.values.items():
            _set(tree.setdefault(section.name, {PARAMETERS: {}})[PARAMETERS], parameter, value)
    return tree


def _write(tree: dict[str, Any], path: Path) -> None:
    write_whole(path, yaml.dump(tree, Dumper=_Dumper, sort_keys=False))


class _Dumper(yaml.SafeDumper):
    """Puts strings in quotation marks that a node would take for something else."""

    def represent_str(self, text: str) -> yaml.ScalarNode:
        """YAML scalar of a string."""
        style = None if scalar(text) == text else '"'
        return self.represent_scalar(TEXT, text, style=style)


_Dumper.add_representer(str, _Dumper.represent_str)


def _set(tree: dict[str, Any], name: str, value: Any) -> None:
    """Set a value in nested tables; points in `name` lead into them."""
    tree.pop(name, None)
    *parts, last = name.split(".")
    for part in parts:
        tree = tree.setdefault(part, {})
    tree[last] = value
