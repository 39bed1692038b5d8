"""What all command lines share: `--help`, `--version`, errors of one line, output into a pipe."""

import argparse
import io
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

PACKAGE = "climber_uk"


class Parser(argparse.ArgumentParser):
    """Parser with `--version`; what is wrong with the arguments is said in one line, status 2."""

    def __init__(self, name: str, description: str | None, epilog: str | None = None) -> None:
        super().__init__(name, description=description, epilog=epilog)
        self.add_argument(
            "--version",
            action=_Version,
            nargs=0,
            default=argparse.SUPPRESS,  # it is no option of what runs
            help="print the version and exit",
        )

    def arguments(self, given: Sequence[str] | None = None) -> argparse.Namespace:
        """Parse; from now on a reader of the output, as `head`, may end before this program."""
        out = sys.stdout
        if out is sys.__stdout__ and out is not None:
            binary = io.BufferedWriter(_Output(out.fileno(), "w", closefd=False))
            sys.stdout = io.TextIOWrapper(
                binary, out.encoding, out.errors, line_buffering=out.line_buffering
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
        """Exit with one line."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def between(least: float, most: float) -> Callable[[str], float]:
    """For `type`: a number within bounds."""

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


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version  # slow to import

        print(parser.prog, version(PACKAGE))
        parser.exit()


class _Output(io.FileIO):
    """Drops what is written after its reader has gone, or the disk is full, which it says.

    Files and exit status stay the same.
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
