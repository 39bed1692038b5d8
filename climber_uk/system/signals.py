"""Signals that ask a process to end: one handler for all, and how to ignore them."""

import signal
from collections.abc import Callable
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
