"""Signals that ask a process to end: one handler for all, and how to ignore them."""

import signal
import sys
from collections.abc import Callable
from functools import partial
from types import TracebackType
from typing import Any

END = signal.SIGINT, signal.SIGTERM, signal.SIGHUP  # Ctrl-C, kill, and a terminal that is closed


class Interrupted(Exception):  # noqa: N818 - it is what happened, not a mistake
    """A signal asked this process to end."""


def on_end(handler: Callable[..., Any]) -> None:
    """Have `handler` called at each signal to end, except SIGHUP where nohup ignores it."""
    for number in END:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def ignore_end() -> None:
    """Ignore these signals: the process is ending, and they come more than once."""
    for number in END:
        signal.signal(number, signal.SIG_IGN)


def interrupted_in_a_line(tool: str) -> None:
    """From now on a `KeyboardInterrupt` that nobody catches is a line, not a traceback.

    Python ends the process by the signal then, as shells expect.
    """
    sys.excepthook = partial(_in_a_line_if_interrupted, tool)


def _in_a_line_if_interrupted(
    tool: str, kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    if issubclass(kind, KeyboardInterrupt):
        print(f"{tool}: interrupted", file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)
