"""docs/interfaces.md and docs/security_policy.xml have each topic and service that code asks for.

Whatever switches it on: the references come from running nodes, which have what they were told to.
"""

import ast
import importlib
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "climber_uk"
HOW = {  # method: what it does, and where its topic and its type stand
    "subscription": ("subscribes", 1, 0),
    "publisher": ("publishes", 1, 0),
    "output": ("publishes", 0, None),
    "create_service": ("serves", 1, 0),
    "ActionServer": ("serves", 2, 1),
}
# where the names come from a table or an argument: they are always there, so nodes tell them
ALWAYS_THERE = {("markers", "subscribes"), ("path_intake", "subscribes")}
ALLOWED = {
    "publishes": "./topics[@publish='ALLOW']/topic",
    "subscribes": "./topics[@subscribe='ALLOW']/topic",
}
SERVED = "./services[@reply='ALLOW']/service", "./actions[@execute='ALLOW']/action"


def rows():
    """(node, word, name, type) of each row of the reference."""
    for section in (ROOT / "docs" / "interfaces.md").read_text().split("\n## ")[1:]:
        node = section.partition("\n")[0]
        for row in re.findall(r"^\| (\w+) \| `(\S+)` \| (\S+) \|", section, re.MULTILINE):
            yield node, *row


ROWS = list(rows())
NODES = sorted({node for node, *_ in ROWS})


def asked_for(file):
    """(word, name, type) of each topic and service in a module's code; name None: not told."""
    module = importlib.import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))
    for call in ast.walk(ast.parse(file.read_text())):
        function = getattr(call, "func", None)
        how = HOW.get(getattr(function, "attr", getattr(function, "id", None)))
        if how is None:
            continue
        word, place, kind = how
        try:
            name = eval(ast.unparse(call.args[place]), vars(module))
        except NameError:
            name = None
        yield word, name, None if kind is None else ast.unparse(call.args[kind])


FILES = [
    *sorted((PACKAGE / "nodes").glob("*.py")),
    *sorted((PACKAGE / "ros").glob("*.py")),
    PACKAGE / "driver_check" / "node.py",
]
OWNERS = {"node": "check_driver", "plant_topics": "plant_simulator"}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_a_module_asks_for_is_in_the_reference(file):
    if file.stem in ("running", "output"):
        return  # they pass it on
    owner = OWNERS.get(file.stem, file.stem)
    of_node = [row for node, *row in ROWS if node == owner or owner not in NODES]
    for word, name, kind in asked_for(file):
        if name is None:
            assert (file.stem, word) in ALWAYS_THERE
            continue
        found = [type_ for how, said, type_ in of_node if (how, said) == (word, name)]
        assert found, (owner, word, name)
        assert kind is None or kind in [type_.partition("/")[2] for type_ in found], (name, kind)


def test_code_is_read():
    found = [each for file in FILES for each in asked_for(file)]
    assert ("subscribes", "joint_states", "JointState") in found
    assert len(found) > 45


@pytest.mark.parametrize("node", NODES)
def test_a_node_is_allowed_all_that_the_reference_has_of_it_and_no_more(node):
    policy = ElementTree.parse(ROOT / "docs" / "security_policy.xml")
    (profile,) = policy.findall(f".//enclave[@path='/{node}']/profiles/profile")
    of_every_node = re.compile(
        "/rosout|/clock|/parameter_events|.*(_parameters(_atomically)?|_types|_description)"
    )
    for word in ("publishes", "subscribes", "serves"):
        paths = [ALLOWED[word]] if word in ALLOWED else SERVED
        allowed = {element.text for path in paths for element in profile.findall(path)}
        said = {name for of, how, name, _ in ROWS if (of, how) == (node, word)}
        full = {name.replace("~", f"/{node}") if "~" in name else f"/{name}" for name in said}
        full = {name.replace("//", "/") for name in full}
        assert full <= allowed
        assert not {name for name in allowed - full if not of_every_node.fullmatch(name)}
