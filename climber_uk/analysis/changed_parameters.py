"""A parameter file with some values changed, for the nodes to load."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from climber_uk.analysis.parameter_file import OWN


def write_changed(
    original: Path | None, changes: Mapping[str, Mapping[str, Any]], path: Path
) -> None:
    """Write what `original` holds, if there is one, with changes by node and parameter.

    They stand in a section of their own at the end, so that they hold in every namespace.
    """
    tree = yaml.safe_load(original.read_text(encoding="utf-8")) if original else {}
    for node, values in changes.items():
        name = f"/**/{node}"
        section = tree.pop(name, {OWN: {}})
        for parameter, value in values.items():
            _set(section[OWN], parameter, value)
        tree[name] = section
    path.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")


def _set(tree: dict[str, Any], name: str, value: Any) -> None:
    tree.pop(name, None)
    *parts, last = name.split(".")
    for part in parts:
        tree = tree.setdefault(part, {})
    tree[last] = value
