"""What `ros2 param describe` tells of a parameter."""

import dataclasses
import importlib
import pkgutil
import re
import sys
from dataclasses import is_dataclass

import pytest

from climber_uk.parameters.declaration import check_value, parameter, parameters
from climber_uk.ros.parameters import descriptor


@parameters
class Several:
    """Bounds of all kinds."""

    open: float = parameter(1.0, "m", "more than none", above=0)
    half: float = parameter(1.0, "m", "none, or more", at_least=0)
    share: float = parameter(0.5, "", "of all", above=0, at_most=1)
    closed: float = parameter(0.5, "rad", "between", at_least=-1, at_most=1, runtime=True)
    count: int = parameter(3, "", "of them", at_least=1, at_most=9)
    free: float = parameter(0.0, "m", "anywhere")
    kind: str = parameter("a", "", "of it", choices=("a", "b"))


@pytest.mark.parametrize(
    ("name", "words", "ends"),
    [
        ("open", "> 0", None),
        ("half", ">= 0", None),
        ("share", "> 0 and <= 1", None),
        ("closed", ">= -1 and <= 1", (-1.0, 1.0)),
        ("count", ">= 1 and <= 9", (1, 9)),
        ("free", "", None),
        ("kind", "one of a, b", None),
    ],
)
def test_bounds_are_told_in_words_and_as_a_range_only_where_both_ends_are_taken(name, words, ends):
    field = next(field for field in dataclasses.fields(Several) if field.name == name)
    told = descriptor(field)
    assert told.additional_constraints == words
    ranges = [*told.floating_point_range, *told.integer_range]
    assert [(each.from_value, each.to_value) for each in ranges] == ([ends] if ends else [])
    for end in ends or ():
        check_value(field, end)
    assert told.read_only == (name != "closed")
    assert told.description.startswith(field.metadata["description"])


def real_fields():
    """Class, and each field of it that is a parameter, of all that the nodes import."""
    for name in ("nodes", "driver_check"):
        package = importlib.import_module(f"climber_uk.{name}")
        for module in pkgutil.iter_modules(package.__path__):
            importlib.import_module(f"{package.__name__}.{module.name}")
    modules = [sys.modules[name] for name in sorted(sys.modules) if name.startswith("climber_uk.")]
    found = [value for module in modules for value in vars(module).values()]
    for kind in dict.fromkeys(kind for kind in found if isinstance(kind, type)):
        if not is_dataclass(kind):
            continue
        for field in dataclasses.fields(kind):
            if "description" in field.metadata:
                yield kind, field


FIELDS = {f"{kind.__name__}.{field.name}": field for kind, field in real_fields()}
# words that only mean something after the line before, or after the parameter's name
LEANS_ON = (
    r"^(of|by|in|at|for|from|to|above|below|ahead|added|with|without|that|which|where it|how it)\b"
    r"|\bthe same (of|for|side)|likewise|^(standard deviation|deviation)$|of (that|those|these)\b"
    r"|\bwhere its\b|\bthat changes\b|\bthat (is kept|it follows)\b"
)


@pytest.mark.parametrize("name", FIELDS)
def test_a_node_takes_what_its_descriptor_offers_and_says_it_in_full(name):
    field = FIELDS[name]
    told = descriptor(field)
    ranges = [*told.floating_point_range, *told.integer_range]
    offered = [end for each in ranges for end in (each.from_value, each.to_value)]
    for value in [field.default, *offered, *(field.metadata["choices"] or ())]:
        check_value(field, value)
    for each in ranges:
        assert each.from_value <= field.default <= each.to_value
    assert "e+" not in told.additional_constraints
    description = field.metadata["description"]
    assert len(description.split()) > 1
    assert not re.search(LEANS_ON, description)


def test_all_parameters_are_looked_at():
    assert len(FIELDS) > 200
