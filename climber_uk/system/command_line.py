"""Command lines: `--help`, `--version`, errors of one line, and output into a closed pipe."""

import argparse
import io
import os
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

PACKAGE = "climber_uk"


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
        """Options; from now on a reader of the output, as `head`, may end before this program."""
        out = sys.stdout
        if out is sys.__stdout__ and out is not None:
            binary = io.BufferedWriter(_Output(out.fileno(), "w", closefd=False))
            sys.stdout = io.TextIOWrapper(
                binary, out.encoding, out.errors, line_buffering=out.line_buffering
            )
        return self.parse_args(given)

    def error(self, message: str) -> NoReturn:
        """Exit with one line and status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version  # slow to import

        print(parser.prog, version(PACKAGE))
        parser.exit()


class _Output(io.FileIO):
    """Output that is dropped once its reader has ended: the program goes on as without it."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), self.fileno())
            return memoryview(data).nbytes
