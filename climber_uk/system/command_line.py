"""Command lines: `--help`, `--version`, errors of one line, and output into a closed pipe."""

import argparse
import io
import math
import os
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn

from climber_uk.system.streams import open_closed_streams

PACKAGE = "climber_uk"


def in_words(error: Exception) -> str:
    """Message of an error, without the number that the operating system has for it."""
    return re.sub(r"^\[Errno -?\d+\] ", "", str(error))


def printable(text: str) -> str:
    """Text that is safe to print: control characters, other than new lines, are escaped."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


class Parser(argparse.ArgumentParser):
    """Parser with `--version`; wrong arguments end with one line and status 2."""

    def __init__(self, name: str, description: str | None, epilog: str | None = None) -> None:
        super().__init__(name, description=description, epilog=epilog)
        self.add_argument(
            "--version",
            action=_Version,
            nargs=0,
            default=argparse.SUPPRESS,  # it is not among the parsed options
            help="print the version and exit",
        )

    def arguments(self, given: Sequence[str] | None = None) -> argparse.Namespace:
        """Parsed options, with `~` in paths expanded.

        From now on a closed output (of `head`) is no error, nor are characters that it cannot show,
        and Ctrl-C ends the tool in a line. Streams that were closed before lead nowhere.
        """
        open_closed_streams()
        sys.excepthook = partial(_in_a_line_if_interrupted, self.prog)
        out = sys.stdout
        if out is sys.__stdout__ and out is not None:
            binary = io.BufferedWriter(_Output(out.fileno(), "w", closefd=False))
            sys.stdout = io.TextIOWrapper(
                binary, out.encoding, "backslashreplace", line_buffering=out.line_buffering
            )
        options = self.parse_args(given)
        for name, value in vars(options).items():
            setattr(options, name, self._at_home(value))
        return options

    def _at_home(self, value: Any) -> Any:
        """The same, paths with the home directory for ~, which shells leave in `--output=~/x`."""
        if isinstance(value, list):
            return [self._at_home(one) for one in value]
        try:
            return value.expanduser() if isinstance(value, Path) else value
        except RuntimeError:
            self.error(f"{value}: there is no such user")

    def error(self, message: str) -> NoReturn:
        """Exit with one line and status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _in_a_line_if_interrupted(
    tool: str, kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """`sys.excepthook` of a tool; Python ends it by the signal then, as shells expect."""
    if issubclass(kind, KeyboardInterrupt):
        print(f"{tool}: interrupted", file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)


def between(least: float, most: float) -> Callable[[str], float]:
    """Return a function for `type` of `add_argument`: a number within bounds."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(
                f"{text!r} must be a number from {least:g} to {most:g}"
            )
        return value

    return read


def whole(least: int, most: int) -> Callable[[str], int]:
    """The same of an integer."""

    def read(text: str) -> int:
        if not (text.isdecimal() and len(text) < 20 and least <= int(text) <= most):
            raise argparse.ArgumentTypeError(f"{text!r} must be an integer from {least} to {most}")
        return int(text)

    return read


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version  # slow to import

        print(parser.prog, version(PACKAGE))
        parser.exit()


class _Output(io.FileIO):
    """Standard output that drops what cannot be written: its reader has gone, or the disk is full.

    The latter is reported. Other files and the exit status are not affected.
    """

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except OSError as error:
            if not isinstance(error, BrokenPipeError):
                print(f"the output is not written: {error.strerror}", file=sys.stderr)
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), self.fileno())
            return memoryview(data).nbytes
