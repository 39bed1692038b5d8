"""What `ros2 param describe` tells of a parameter."""

import dataclasses
import re
from pathlib import Path

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


ROWS = re.compile(r"^\| `([\w.]+)` \|.*\| (.*) \|$", re.MULTILINE)
# A clause about a neighbour, or about the part that it belongs to: on its own it says nothing
LEANING = re.compile(
    r"(of|in|for|at|from|by|above|below|after|away|ahead|without|beyond|that|which|added|times"
    r"|the same|its|it|where (it|its|what)|which of|how (it|they|that)|fastest that) "
)


def test_a_description_stands_alone_as_ros2_param_describe_shows_it():
    said = set(ROWS.findall((Path(__file__).parents[2] / "docs" / "parameters.md").read_text()))
    assert len(said) > 200
    assert [each for each in sorted(said) if LEANING.match(each[1])] == []
