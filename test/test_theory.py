"""Every equation "(n)" and section "§n" that code and docs cite stands in docs/theory.md."""

import ast
import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
THEORY = (ROOT / "docs" / "theory.md").read_text()
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MODULES = sorted((ROOT / "climber_uk").rglob("*.py"))
BESIDE = [*sorted((ROOT / "bench").rglob("*.py")), *sorted((ROOT / "examples").rglob("*.py"))]

# A number of one or two digits alone in brackets, from 1 on, that is not the argument of a call
EQUATION = re.compile(r"(?<![\w\])\"'`])\(([1-9]\d?)\)(?!\w)")
SECTION = re.compile(r"§\s?(\d+(?:\.\d+)*)")
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)  # of Markdown, in which nothing is cited
MATH = re.compile(r"```math\n(.*?)```", re.DOTALL)

EQUATIONS = set(re.findall(r"\\tag\{(\d+)\}", "".join(MATH.findall(THEORY))))
SECTIONS = set(re.findall(r"^#+ (\d+(?:\.\d+)*)\.? ", THEORY, re.MULTILINE))


def prose(file, text):
    """What of a file may cite: docstrings and comments of Python, Markdown without its code."""
    if file.suffix == ".md":
        return CODE.sub("", text)
    found, begins = [], True  # whether a statement does
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            found.append(token.string)
        elif begins and token.type == tokenize.STRING:
            found.append(ast.literal_eval(token.string))
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            begins = token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
    return "\n".join(found)


def unresolved(file, text):
    """Citations of a file that docs/theory.md has not, as they are written."""
    written = prose(file, text)
    equations = [f"({n})" for n in EQUATION.findall(written) if n not in EQUATIONS]
    return equations + [f"§{n}" for n in SECTION.findall(written) if n not in SECTIONS]


def test_what_is_cited_stands_in_the_theory():
    wrong = {}
    for file in PAGES + MODULES + BESIDE:
        if citations := unresolved(file, file.read_text()):
            wrong[str(file.relative_to(ROOT))] = citations
    assert not wrong


@pytest.mark.parametrize(
    ("name", "text", "wrong"),
    [
        ("a.py", '"""As (31) has it."""\n', ["(31)"]),
        ("a.py", '"""By (8), (14)-(55)."""\n', ["(55)"]),
        ("a.py", "x = f(99)  # by (99)\n", ["(99)"]),
        ("a.py", 'def f():\n    """See §13, §5.9 and §5.1."""\n', ["§13", "§5.9"]),
        (
            "a.py",
            'x = "(99) is no citation"\n"""nor are x(99), p(1), (0), (3,) or A[2](99)."""\n',
            [],
        ),
        ("a.md", "Equation (2), which the theory leaves out.\n", ["(2)"]),
        ("a.md", "`state (77)` and\n```\n(78)\n```\nare code.\n\n    f = m a   (79)\n", ["(79)"]),
        ("a.md", "[§99](theory.md#99)", ["§99"]),
    ],
)
def test_a_wrong_citation_is_found_and_what_is_none_is_not(name, text, wrong):
    assert unresolved(Path(name), text) == wrong


def test_every_equation_can_be_linked_to():
    assert set(re.findall(r'<a id="eq-(\d+)"></a>', THEORY)) == EQUATIONS
    assert {"8", "11", "15", "17", "26", "30"} <= EQUATIONS


def test_references_are_numbered_and_each_is_cited():
    body, references = THEORY.split("## 12. References")
    numbers = re.findall(r"^(\d+)\. ", references, re.MULTILINE)
    assert numbers == [str(n + 1) for n in range(len(numbers))]
    assert set(re.findall(r"\[(\d+)\](?!\()", body)) == set(numbers)


def test_names_of_the_symbols_are_those_of_the_code():
    tables = re.findall(r"\| name in the code \|\n(.*?)\n\n", THEORY, re.DOTALL)
    cells = [row.split("|")[-2] for table in tables for row in table.splitlines()[1:]]
    names = {name for cell in cells for name in re.findall(r"`(\w+)`", cell)}
    assert len(names) > 40
    code = "\n".join(module.read_text() for module in MODULES)
    assert not {name for name in names if not re.search(rf"\b{name}\b", code)}


def test_formulas_survive_markdown():
    """Between dollar signs a star, a comma after a backslash and a new line are Markdown's own."""
    inline = re.findall(r"\$([^$]+)\$", CODE.sub("", MATH.sub("", THEORY)))
    assert len(inline) > 100
    assert not [formula for formula in inline if re.search(r"\*|\n|\\[^a-zA-Z]", formula)]
    for formula in MATH.findall(THEORY):
        assert formula.count("{") == formula.count("}")
        assert formula.count(r"\begin") == formula.count(r"\end")
        brackets = re.findall(r"\\(left|right)\b", formula)
        assert brackets.count("left") == brackets.count("right")
