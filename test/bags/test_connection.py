import pytest

from climber_uk.bags.connection import LONGEST_LINE, is_name, listed, one_line


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("/odom, ünï 中", "/odom, ünï 中"),
        ("\x1b[31mred\x07", r"\x1b[31mred\x07"),
        ("two\n\tlines", "two lines"),
        ("\u202eback \udcff", r"\u202eback \udcff"),
        ("a\0b\x9b2J", r"a\x00b\x9b2J"),
    ],
)
def test_nothing_that_a_file_tells_commands_a_terminal(text, shown):
    assert one_line(text) == shown
    assert one_line(text).isprintable()


def test_a_line_has_an_end():
    assert one_line("x" * 10**6) == "x" * LONGEST_LINE + "…"


@pytest.mark.parametrize("name", ["\x1b[31m", "a\nb", "x" * 10**6, None, 5, b"odom", "\u202e"])
def test_what_cannot_be_printed_is_no_name(name):
    assert not is_name(name)


def test_at_most_three_of_a_list_are_named():
    assert listed([]) == "nothing"
    assert listed(["a", "b", "c"]) == "a, b, c"
    assert listed(["a", "b", "c", "d", "e"]) == "a, b, c and 2 more"
