"""Processes that end together: signals that ask for the end, and children that do not outlive."""

import os
import signal
import subprocess
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

END = signal.SIGINT, signal.SIGTERM, signal.SIGHUP  # Ctrl-C, kill, and a terminal that is closed
PR_SET_PDEATHSIG = 1


def on_end(handler: Callable[..., Any]) -> None:
    """Call `handler` for every signal that asks this process to end, but for one nohup ignores."""
    for number in END:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def ignore_end() -> None:
    """Ignore these signals: the process is ending, and they come more than once."""
    for number in END:
        signal.signal(number, signal.SIG_IGN)


def start(command: Sequence[str | Path], **options: Any) -> "subprocess.Popen[bytes]":
    """Start a process that gets SIGTERM when this one ends, however it does; see `Popen`."""
    return subprocess.Popen(command, preexec_fn=partial(end_with, os.getpid()), **options)


def end_with(parent: int) -> None:
    """Have this process get SIGTERM when its parent, of that id, ends, be it by SIGKILL."""
    import ctypes  # few need it

    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it ended before
        os.kill(os.getpid(), signal.SIGTERM)


def call(command: Sequence[str | Path]) -> int:
    """Run a command to its end and return its status; signals to end are passed on to it."""
    process = start(command)
    before = {number: signal.getsignal(number) for number in END}
    on_end(lambda number, _: process.send_signal(number))
    try:
        return process.wait()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
