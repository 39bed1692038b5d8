"""An exit that nothing can hold up: no library, not even one that keeps the interpreter's lock."""

import ctypes
import math
import sys
from functools import cache

CLOCK_MONOTONIC, SIGEV_THREAD = 1, 2
LIBRT = ctypes.CDLL("librt.so.1")  # with libc, where its functions are since glibc 2.34


class _Event(ctypes.Structure):
    """`struct sigevent` of 64-bit Linux: what a timer does when it is over."""

    _fields_ = (
        ("value", ctypes.c_void_p),
        ("signal", ctypes.c_int),
        ("how", ctypes.c_int),
        ("function", ctypes.c_void_p),
        ("rest", ctypes.c_byte * 40),
    )


class _Setting(ctypes.Structure):
    """`struct itimerspec`: every how long, and after how long at first."""

    _fields_ = tuple(
        (name, ctypes.c_long) for name in ("every_s", "every_ns", "after_s", "after_ns")
    )


def exit_after(seconds: float, status: int) -> None:
    """End this process with `status` in so many seconds, unless it has ended before by itself.

    Another call with the same status begins to count anew. What has been printed is written now;
    nothing else is done at the end. A thread of libc does it: one of Python, or the handler of a
    signal, would wait for a library that does not come back. Raises `OSError` without a timer.
    """
    for stream in filter(None, (sys.stdout, sys.stderr)):  # None: it was closed from the start
        stream.flush()
    fraction, whole = math.modf(seconds)
    setting = _Setting(after_s=int(whole), after_ns=int(1e9 * fraction))
    if LIBRT.timer_settime(_timer(status), 0, ctypes.byref(setting), None):
        raise OSError("timer_settime")


@cache
def _timer(status: int) -> ctypes.c_void_p:
    leave = ctypes.cast(LIBRT._exit, ctypes.c_void_p)
    event = _Event(value=status, how=SIGEV_THREAD, function=leave.value)
    timer = ctypes.c_void_p()
    if LIBRT.timer_create(CLOCK_MONOTONIC, ctypes.byref(event), ctypes.byref(timer)):
        raise OSError("timer_create")
    return timer
