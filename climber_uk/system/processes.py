"""Child processes that do not outlive this process."""

import ctypes
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from climber_uk.system.signals import END, on_end

LIBC = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1


def dies_with_me() -> Callable[[], None]:
    """Return a `preexec_fn` for `Popen`, by which the child gets SIGTERM when this process ends."""
    return partial(_begin_child, os.getpid())


def _begin_child(parent: int) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)  # else one before `exec` would be lost
    die_with(parent)


def die_with(parent: int) -> None:
    """Have this process get SIGTERM when its parent, of that process id, ends in any way."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it has ended already
        os.kill(os.getpid(), signal.SIGTERM)


def call(command: Sequence[str | Path]) -> int:
    """Run a command to its end and return its status; signals to end are passed on to it."""
    process = subprocess.Popen(command, preexec_fn=dies_with_me())
    before = {number: signal.getsignal(number) for number in END}
    on_end(lambda number, _: process.send_signal(number))
    try:
        while (status := process.poll()) is None:
            time.sleep(0.05)  # a signal just before one long wait would be passed on after it
        return status
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end(
    processes: Mapping[str, "subprocess.Popen[bytes]"], patience: Callable[[], float]
) -> list[str]:
    """End processes by SIGTERM; by SIGKILL those that have not ended after `patience()` [s].

    `patience` is called again and again, as it may shrink meanwhile. Returns the names of those
    that were killed.
    """
    for process in processes.values():
        process.send_signal(signal.SIGTERM)
    begin = time.monotonic()
    killed: list[str] = []
    while alive := [name for name, process in processes.items() if process.poll() is None]:
        if not killed and time.monotonic() > begin + patience():
            killed = alive
            for name in killed:
                processes[name].kill()
        time.sleep(0.02)
    return killed
