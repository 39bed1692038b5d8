"""Every command in the documents is one that can be given: program, options, names and files."""

import ast
import importlib
import re
import shlex
import subprocess
import sys
from importlib.metadata import entry_points
from itertools import pairwise
from pathlib import Path

import pytest

from climber_uk.closed_loop.node_parameters import names_of
from climber_uk.messages.topics import CONTROLLER, LOCALIZATION, PLANNER, PLANT
from climber_uk.system.command_line import Parser

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
OURS = {
    script.name: f"climber_uk.{script.attr}"
    for script in entry_points(group="console_scripts")
    if script.value.startswith("climber_uk.")
}
NODES = {PLANNER, CONTROLLER, PLANT, LOCALIZATION, "markers", "check_driver"}
PROGRAMS = {*OURS, "make", "python", "pytest", "climber.launch.py"}
PLACEHOLDER = re.compile(r"[A-Z]+|…|dev|[a-z]+…|/.*…|run|my_.*|demo.*|again|[a-z]+\.(yaml|png|csv)")
PARTS = re.compile(r"^ *```(\w*)\n(.*?)^ *```|`([^`]+)`", re.DOTALL | re.MULTILINE)
PREFIX = re.compile(
    r"^(\$ |\.venv/bin/|[A-Z_]+=\S+ |ros2 run climber_uk |ros2 launch climber_uk )+|[][]|\|\w+"
)


class Parsed(BaseException):
    """A command line was understood."""


def commands(page):
    """Each command of a page, as words, once, in the order of the page."""
    lines = []
    for kind, block, word in PARTS.findall(page.read_text()):
        written = block.replace("\\\n", " ").splitlines() if not word and not kind else [word]
        lines += [line.partition(" #")[0] if block else line for line in written]
    found = {}
    for line in lines:
        bare = PREFIX.sub("", " ".join(line.split()))
        program, _, rest = bare.partition(" ")
        if program in PROGRAMS and rest and "──" not in rest:
            found[bare] = shlex.split(bare)
    return found.values()


GIVEN = [(page, words) for page in PAGES for words in commands(page)]

# Those that test/nodes/test_readme.py gives as they are written, in soak, one after the other: all
# of ours with nothing left to fill in, that soon end
DEMOS = re.findall(r"^\| `(C\w+=[\w/.]+)` \|", README, re.MULTILINE)  # a test for each, there
OPEN = re.compile(r"[A-Z]+|…|.*:=value|my_.*")  # for the reader to fill in
TOOLS = set(OURS) - NODES - {"campaign", "climber", "record_bag"}


def is_whole(words):
    """Whether a command of a page is one of ours that can be given just so, and soon ends."""
    is_ours = words[0] in TOOLS or (words[:2] == ["make", "demo"] and words[2:])
    is_in_the_table = words[2:] in [[variable] for variable in DEMOS]
    return is_ours and not is_in_the_table and not any(OPEN.fullmatch(word) for word in words)


WHOLE = {}
for page, words in GIVEN:
    if is_whole(words):
        WHOLE.setdefault(page.name, []).append(words)

# All others, by what they look like: why they are not given as they are written, and what is. By
# the tests of this file they can be given: program, options, names and files are there.
ONLY_PARSED = {
    r"pytest .*": "is a test",
    r"make (test|unit|lint|coverage|soak|test-kilted)": "runs the tests",
    r"make help": "test_make_tells_what_there_is, below",
    r"make demo( …| (CONFIG|CORNERS)=config/\w+.\w+)?": "test_readme.py, with other directories",
    r"make (paper|docs)": "test/paper and test/nodes/test_docs.py run what it runs",
    r"make (bench|physics|sbom)": "installs other packages first",
    r"make campaign|campaign (config/campaign.yaml|FILE).*|campaign examples/.*": "takes minutes "
    "to hours; test/campaign and test/nodes/test_own_law.py run smaller ones",
    r"python requirements.py": "fetches 600 MB: test_requirements.py looks at what it has written",
    r"python examples/second_publisher.py": "needs a climber that drives: test_faults.py gives it",
    r"(\w+|python examples/\w+.py) --ros-args .*|markers &": "ends with Ctrl-C: test_readme.py "
    "starts those of the README together, test/nodes each with its parameters",
    r"record_bag .*|analyze_bag my_bag": "test_readme.py, with the nodes; the reader's topics",
    r"climber \w+": "needs a climber that drives: test/nodes/test_operating.py",
    r"climber.launch.py .*": "needs launch, of an installation: test/test_launch.py",
    r"check_driver .*": "needs a driver: test/nodes/test_check_driver.py",
    r"python bench/.*": "minutes to hours; that each starts: test_bench.py",
    r"python test/nodes/odometry_trace.py": "test_architecture.py has the table of its calls",
    r".*\b(BAG|A B|FILE|TOPIC)\b.*": "the reader's own; test_readme.py gives those of the README",
}


def of(*programs):
    """The commands of some programs, as parameters of a test."""
    rows = {(page.name, *words): words for page, words in GIVEN if words[0] in programs}
    ids = [" ".join(row) for row in rows]
    return pytest.mark.parametrize("words", rows.values(), ids=ids)


def check_files(words):
    """Assert that files which are named are in the repository, or are somebody's own."""
    for word in " ".join(words).split():
        path = word.split("=")[-1]
        if re.search(r"/|\.(yaml|csv|py)$", path) and not PLACEHOLDER.fullmatch(
            path.strip("/").split("/")[0]
        ):
            assert (ROOT / path).exists() or ":" in path, path


@of(*(set(OURS) - NODES))
def test_a_tool_understands_it(words, monkeypatch):
    def arguments(parser, given=None):
        parser.parse_args(given)
        raise Parsed

    name, *given = words
    given = [word.replace("NUMBER", "1") for word in given if word != "…"]
    monkeypatch.setattr(Parser, "arguments", arguments)
    monkeypatch.setattr(sys, "argv", [name, *given])
    with pytest.raises(Parsed):
        importlib.import_module(OURS[name]).main()
    check_files(given)


def check_node(words):
    """Assert that parameters which are given are a node's, and that its files are there."""
    known = {"device"}.union(*map(names_of, (PLANNER, CONTROLLER, PLANT)))
    given = [word for before, word in pairwise(words) if before == "-p"]
    assert {word.partition(":=")[0] for word in given} <= known
    check_files(words)


@of(*NODES)
def test_a_node_has_these_parameters_and_there_are_these_files(words):
    check_node(words[1:])


@of("make")
def test_make_has_this_target_and_takes_this_variable(words):
    makefile = (ROOT / "Makefile").read_text()
    for word in words[1:]:
        name, is_variable, value = word.partition("=")
        pattern = rf"^{name} [?:]=" if is_variable else rf"^{name}:"
        assert word == "…" or re.search(pattern, makefile, re.MULTILINE), word
        check_files([value])


def test_a_variable_of_make_in_small_letters_is_refused_and_one_with_a_blank_is_one_word():
    def said(words):
        ran = subprocess.run(["make", "-n", *words], cwd=ROOT, capture_output=True, text=True)
        return ran.stdout + ran.stderr

    assert "config= is not heeded: its name is in capitals" in said(["demo", "config=x.yaml"])
    assert '--config "my dir/x.yaml"' in said(["demo", "CONFIG=my dir/x.yaml"])


@of("python")
def test_a_script_is_there_and_has_these_options(words):
    script = (ROOT / words[1]).read_text()
    if "--ros-args" in words:
        return check_node(words[2:])
    for word in words[2:]:
        if word.startswith("--") and word != "--help":
            assert re.search(rf"[\"']({word}|{word[2:]})[\"']", script), word
    return check_files(words[2:])


@of("pytest")
def test_tests_are_there_and_k_finds_some(words):
    files = [ROOT / word for word in words[1:] if word.startswith("test/")]
    assert all(file.exists() for file in files)
    sought = words[words.index("-k") + 1] if "-k" in words else ""
    inside = [f for file in files or [ROOT / "test"] for f in (file, *file.rglob("*.py"))]
    text = "\n".join(file.read_text() for file in inside if file.is_file())
    for word in set(sought.split()) - {"and", "or", "not"}:
        assert re.search(rf"def test_\w*{word}|id=.*{word}|\"[^\"]*{word}", text, re.IGNORECASE)


def soak_alone(file):
    """Whether each test of a file is one, by its name; not one whose rows are partly."""
    tree = ast.parse(file.read_text())
    marks = [ast.unparse(node) for node in tree.body if isinstance(node, ast.Assign)]
    whole = any(mark.startswith("pytestmark") and "mark.soak" in mark for mark in marks)
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            named = [ast.unparse(decorator) for decorator in node.decorator_list]
            yield node.name, whole or any(it in ("pytest.mark.soak", "soak") for it in named)


@of("pytest")
def test_tests_that_are_soak_alone_are_asked_for_as_such(words):
    sought = words[words.index("-k") + 1].lower() if "-k" in words else ""
    files = [ROOT / word for word in words[1:] if word.endswith(".py")]
    found = [
        is_soak for f in files for name, is_soak in soak_alone(f) if not sought or sought in name
    ]
    assert "soak" in " ".join(words) or not found or not all(found)


@of("climber.launch.py")
def test_the_launch_file_has_these_arguments(words):
    launch = (ROOT / "launch" / words[0]).read_text()
    for word in words[1:]:
        assert f'"{word.partition(":=")[0]}"' in launch


def test_there_are_commands():
    assert len(GIVEN) > 150


def test_what_is_only_parsed_is_listed_with_the_reason():
    run = [words for rows in WHOLE.values() for words in rows]
    others = {" ".join(words) for _, words in GIVEN if words not in run}
    fits = {line: [p for p in ONLY_PARSED if re.fullmatch(p, line)] for line in others}
    assert not [line for line, found in fits.items() if not found]
    assert {found[0] for found in fits.values()} == set(ONLY_PARSED)  # none of them is idle


def test_make_tells_what_there_is():
    told = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True)
    makefile = (ROOT / "Makefile").read_text()
    targets = [words[1] for _, words in GIVEN if words[0] == "make" and words[1] != "help"]
    lines = [line.split()[1] for line in told.stdout.splitlines()]
    assert set(targets) <= set(lines)
    assert all(re.search(rf"^{name}:", makefile, re.MULTILINE) for name in lines)
