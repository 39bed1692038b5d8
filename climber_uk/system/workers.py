"""Worker processes, which end with this process in any case."""

import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from climber_uk.system.processes import die_with


@contextmanager
def workers(number: int | None) -> Iterator[ProcessPoolExecutor]:
    """Executor of `number` processes (None: one for each core); an exception ends them at once."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(number, spawn, _start, (os.getpid(),)) as executor:
        try:
            yield executor
        except BaseException:
            before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # or a second one leaves some
            for process in multiprocessing.active_children():
                process.terminate()
            signal.signal(signal.SIGINT, before)
            raise


def _start(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that started it
    die_with(parent)
