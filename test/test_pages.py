"""The docs lead from one page to the next, and docs/README.md to all of them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.glob("*.md"))]
CODE = re.compile(r"```.*?```|`[^`\n]*`", re.DOTALL)


def anchors(page):
    """Ids of a page's headings, as GitHub makes them, and those that are written."""
    text = page.read_text()
    written = re.findall(r'<a id="([^"]+)">', text)
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    for heading in re.findall(r"^#+ +(.*?) *$", text, re.MULTILINE):
        words = re.sub(r"[^\w\- ]", "", heading.replace("`", "").lower())
        written.append(words.replace(" ", "-"))
    return written


def links_of(text):
    return re.findall(r"\]\(([^)\s]+)\)", CODE.sub("", text))


def links(page):
    return links_of(page.read_text())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for link in links(page):
        if re.match(r"\w+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_are_named_are_there(page):
    named = re.findall(r"(?<![\w/.])((?:[a-z_]+/)+[\w.]+\.(?:py|c|yaml|md))\b", page.read_text())
    roots = ROOT, ROOT / "climber_uk", ROOT / "docs"
    ours = [path for path in named if not path.startswith("run/")]  # else a command writes it
    assert not [path for path in ours if not any((root / path).exists() for root in roots)]


def test_the_index_has_each_page_once_with_what_it_tells():
    lines = (DOCS / "README.md").read_text().splitlines()
    entries = [match for line in lines if (match := re.match(r"- \[.+\]\((\S+\.md)\): \S", line))]
    listed = [entry[1] for entry in entries]
    assert sorted(listed) == sorted(
        page.name for page in DOCS.glob("*.md") if page.stem != "README"
    )


@pytest.mark.parametrize(
    "section", ["Run the nodes one by one", "Your path", "Your robot", "From a bag to an answer"]
)
def test_what_a_reader_begins_with_has_a_command_and_a_light_picture(section):
    text = (ROOT / "README.md").read_text().split(f"\n## {section}\n")[1].split("\n## ")[0]
    assert re.search(r"^```\n\w+", text, re.MULTILINE)
    pictures = [link for link in links_of(text) if "/figures/" in link]
    assert pictures
    assert all((ROOT / picture).stat().st_size < 150_000 for picture in pictures)


def test_figures_are_all_shown():
    shown = {Path(link).name for page in PAGES for link in links(page)}
    assert {figure.name for figure in (DOCS / "figures").iterdir()} <= shown


def test_the_glossary_is_in_alphabetical_order():
    terms = re.findall(r"^\*\*(.+?)\*\*", (DOCS / "glossary.md").read_text(), re.MULTILINE)
    assert len(terms) > 40
    assert terms == sorted(terms, key=str.casefold)
