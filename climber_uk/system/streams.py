"""Standard streams that were closed when the process was started: they lead nowhere then."""

import os
import sys


def open_closed_streams() -> None:
    """Open /dev/null in place of each closed one of standard input, output and errors.

    Else the next file or socket would get its number, and what is printed.
    """
    for number, (name, mode) in enumerate((("stdin", "r"), ("stdout", "w"), ("stderr", "w"))):
        try:
            os.fstat(number)
        except OSError:
            # gets the lowest number that is free, and is for children, too
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
            stream = open(number, mode, closefd=False)  # noqa: SIM115 - as long as the process
            setattr(sys, name, stream)
            setattr(sys, f"__{name}__", stream)
