"""Programs of the package and examples in processes that need not import everything again.

A node spends half a second of the processor on importing rclpy, its messages, and the package, and
tests of nodes would spend most of theirs on that. Here a server does that once (`preloaded`), and
forks; what runs in the forked process is what the installed script calls, with its words and its
environment.
"""

import multiprocessing
import os
import runpy
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path
from unittest.mock import patch

EXAMPLES = Path(__file__).parents[2] / "examples"
PARTS = "nodes.", "recording.", "operating.", "driver_check."
PROGRAMS = {
    script.name: script
    for script in entry_points(group="console_scripts")
    if script.module == "climber_uk.executables" and script.attr.startswith(PARTS)
}
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["preloaded"])


def main(name, words, log, environment, directory):
    """Be the program or example of a name, from here on."""
    file = os.open(log, os.O_WRONLY | os.O_APPEND)
    os.dup2(file, sys.stdout.fileno())
    os.dup2(file, sys.stderr.fileno())
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(directory)
    sys.argv = [name, *words]
    if name in PROGRAMS:
        PROGRAMS[name].load()()
    else:
        sys.path.insert(0, str(EXAMPLES))
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")


class Forked:
    """A process with a program or example: as much of `subprocess.Popen` as the tests use."""

    def __init__(self, name, words, log, environment):
        arguments = name, [str(word) for word in words], str(log), environment, os.getcwd()
        self.process = SERVER.Process(target=main, args=arguments, daemon=True)
        with patch.dict(os.environ, PYTHONPATH=str(Path(__file__).parent)):
            self.process.start()  # and the server, if it is the first: it heeds that
        self.pid = self.process.pid
        self.terminate, self.kill = self.process.terminate, self.process.kill

    @property
    def returncode(self):
        return self.process.exitcode

    def poll(self):
        return self.returncode

    def wait(self, timeout=None):
        self.process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired(self.process.name, timeout)
        return self.returncode

    def send_signal(self, number):
        if self.returncode is None:
            os.kill(self.pid, number)
