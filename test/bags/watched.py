"""Runs tools one by one, each in a process of its own: how it ended, its time and its memory.

A job is a line of JSON on standard input: tool, arguments and directory. The answer is one too.
What the tool prints is in the files `out` and `err` of the directory.
"""

import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from pathlib import Path

PATIENCE = 120  # [s]
MEMORY = 8 * 2**30  # [bytes] of addresses
TOOLS = {
    "analyze_bag": "report",
    "animate_bag": "report",
    "compare_bags": "report",
    "identify": "identification",
    "export_tum": "report",
    "localize": "replay",
    "replay_controller": "replay",
}  # and the rooms that they are in


def run(job):
    """Be the tool; does not return."""
    directory = Path(job["directory"])
    os.chdir(directory)
    tempfile.tempdir = str(directory / "tmp")
    for name, stream in (("out", 1), ("err", 2)):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.alarm(PATIENCE)
    sys.argv = [job["tool"], *job["arguments"]]
    status = 0
    try:
        importlib.import_module(f"climber_uk.{TOOLS[job['tool']]}.{job['tool']}").main()
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        status = 1 if isinstance(end.code, str) else end.code or 0
    except BaseException:
        traceback.print_exc()
        status = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


def main():
    for tool, room in TOOLS.items():
        importlib.import_module(f"climber_uk.{room}.{tool}")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for line in sys.stdin:
        begin = time.monotonic()
        child = os.fork()
        if child == 0:
            run(json.loads(line))
        _, status, used = os.wait4(child, 0)
        told = {
            "status": os.waitstatus_to_exitcode(status),
            "seconds": time.monotonic() - begin,
            "memory": (used.ru_maxrss - before) * 1024,  # beyond what the tool has anyway
        }
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    main()
