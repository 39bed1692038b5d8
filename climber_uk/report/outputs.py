"""Where the tools that read a bag write, how they fail, and how they print text of files safely.

One rule for all: into the directory that `--output` names; else into a new one in the bag, or
beside it if it is a single file. Nothing that was there before is overwritten then.
"""

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from tempfile import TemporaryFile, gettempdir

from climber_uk.bags.connection import one_line
from climber_uk.system.command_line import Parser, in_words

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # a disk, somebody's share of it, or a limit
UNREADABLE = 2  # exit status: a bag or a parameter file that is not to be read, a wrong argument


def parser_for_bag(tool: str, description: str | None, name: str) -> Parser:
    """Parser of a tool that reads one climber of a bag, and writes into `output` of this `name`."""
    parser = Parser(tool, description)
    parser.add_argument("bag", type=Path, help="rosbag2 directory or file, MCAP or sqlite3")
    parser.add_argument("--namespace", default="", help="of the climber (default: none)")
    parser.add_argument(
        *("--output", "-o"),
        type=Path,
        help=f"directory (default: a new one, {name}, in the bag or beside it)",
    )
    return parser


def add_remap(parser: Parser) -> None:
    """Add the option by which topics may have other names: rules of `Topics.parse`."""
    parser.add_argument(
        "--remap",
        action="append",
        default=[],
        metavar="FROM:=TO",
        help="other name of a topic, as in odom:=/robot/odom; may be repeated",
    )


@contextmanager
def failing_in_a_line(tool: str) -> Iterator[list[str]]:
    """Have a tool end with one line and status 2 where it raises `OSError` or `ValueError`.

    Yields a list for remarks, on what of a bag could not be read, or can hardly be meant in a
    parameter file: a line each where all goes well, and else in brackets behind the reason.
    """
    remarks: list[str] = []
    try:
        yield remarks
    except (ValueError, OSError) as error:
        behind = f" ({'; '.join(dict.fromkeys(remarks))})" if remarks else ""
        print(f"{tool}: {one_line(in_words(error) + behind)}", file=sys.stderr)
        sys.exit(UNREADABLE)
    for remark in dict.fromkeys(remarks):
        print(f"{tool}: {one_line(remark)}", file=sys.stderr)


@contextmanager
def output(bag: Path, name: str, given: Path | None) -> Iterator[Path]:
    """Make an output directory for a bag; remove it afterwards if it is empty.

    It is `given`, or the first of `name`, `name_2`, … that does not exist. Raises `OSError`, with a
    message of one line, if there is no bag, or if it cannot be written into.
    """
    if not bag.exists():
        raise FileNotFoundError(f"there is no bag {one_line(str(bag))}")
    directory = given or new_directory(bag, name)
    made = [path for path in (directory, *directory.parents) if not path.exists()]
    try:
        check_writable(directory)
        yield directory
    except OSError as error:
        if error.errno not in FULL or error.filename is not None:
            raise
        # a write does not know its file
        raise OSError(f"{error.strerror}: in {directory}, or {gettempdir()}") from None
    finally:
        for path in made:
            with suppress(OSError):  # it is not empty
                path.rmdir()


def new_directory(bag: Path, name: str) -> Path:
    """Directory in a bag, or beside a bag of one file, that does not exist yet."""
    first = bag / name if bag.is_dir() else bag.with_name(f"{bag.stem}_{name}")
    others = (first.with_name(f"{first.name}_{number}") for number in count(2))
    return first if not first.exists() else next(path for path in others if not path.exists())


def check_writable(directory: Path) -> None:
    """Make a directory, if need be; raises `OSError` unless files can be written into it."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise OSError(
            f"cannot write into {directory} ({error.strerror}): --output says where else"
        ) from None
