"""Executables: `climber_uk.executables:nodes.markers` runs `main` of `climber_uk.nodes.markers`.

What that imports takes up to a second. A Ctrl-C meanwhile ends the executable in a line; what is
imported as a library leaves it to its importer.
"""

import os
import signal
import sys
from importlib import import_module  # and nothing that would take long itself


class Executable:
    """What is run by a module's `main`, or the room of several, by a dotted name."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, part: str) -> "Executable":
        return Executable(f"{self._name}.{part}")

    def __call__(self) -> object:
        """Import the module, and run its `main`."""
        usual = signal.default_int_handler
        if signal.getsignal(signal.SIGINT) is usual:  # in the background it is ignored
            signal.signal(signal.SIGINT, _end)
        main = import_module(self._name).main
        if signal.getsignal(signal.SIGINT) is _end:
            signal.signal(signal.SIGINT, usual)
        return main()


def __getattr__(part: str) -> Executable:
    if part.startswith("__"):  # what the import system looks for
        raise AttributeError(part)
    return Executable(f"{__package__}.{part}")


def _end(number: int, _: object) -> None:
    """End by the signal, as shells expect."""
    print(f"{os.path.basename(sys.argv[0])}: interrupted", file=sys.stderr, flush=True)
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)
