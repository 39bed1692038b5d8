"""Whatever a bag is, a tool ends in time, within memory, with one line, and touches nothing else.

`pytest -m soak -s test/bags/test_hostile_bags.py` does it with 2000 bags, most of them damaged
as well.
"""

import itertools
import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import watched
from hostile_bags import HEAVY, KINDS, damage, victims

BAGS = int(os.environ.get("HOSTILE_BAGS", "2000"))
# the tools in turn; to draw takes most of the time
SLOW = "analyze_bag", "compare_bags", "animate_bag"
QUICK = "export_tum", "identify", "localize", "replay_controller"
TURNS = [tool for slow in SLOW for tool in (slow, *QUICK)]
MORE = {"identify": [], "animate_bag": ["--output", "output", "--seconds", "0.5", "--rate", "4"]}
MOST_SECONDS = 90  # on a busy machine
MOST_MEMORY = 2**30  # [bytes] beyond the bag's size
MOST_LINES = 25  # what could not be read, and is told


class Watch:
    """Runs tools, and looks at what they leave."""

    def __init__(self, directory):
        self.directory = directory
        self.server = subprocess.Popen(
            [sys.executable, watched.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def close(self):
        with self.server as server:
            server.stdin.close()

    def run(self, name, seed, spoil=False, tool="analyze_bag"):
        """Make a bag of a kind, give it to a tool, and check all; how it ended."""
        place = self.directory / f"{name}-{seed}"
        (place / "tmp").mkdir(parents=True)
        here = Path.cwd()
        os.chdir(place)
        try:
            rng = np.random.default_rng(seed)
            victims(place)
            KINDS[name](place / "bag", rng)
            if spoil:
                damage(place / "bag", rng)
            bags = ["bag", "bag"] if tool == "compare_bags" else ["bag"]
            arguments = [*bags, *MORE.get(tool, ["--output", "output"])]
            before = snapshot(place)
            job = {"tool": tool, "arguments": arguments, "directory": str(place)}
            print(json.dumps(job), file=self.server.stdin, flush=True)
            ended = json.loads(self.server.stdout.readline())
            check(place, ended, before, tool)
        finally:
            os.chdir(here)
        shutil.rmtree(place)
        return ended


def snapshot(place):
    """All files but those that the tool may write, with what would change with them."""
    found = {}
    for path in sorted(place.rglob("*")):
        known = path.relative_to(place)
        if known.parts[0] not in ("output", "out", "err") and known != Path("tmp"):
            told = path.lstat()
            found[str(known)] = (told.st_ino, told.st_mode, told.st_size, told.st_mtime_ns)
    return found


def size(bag):
    """What a bag takes on the disk [bytes]."""
    return sum(512 * path.lstat().st_blocks for path in bag.rglob("*"))


def check(place, ended, before, tool):
    said = (place / "err").read_bytes().decode()
    told = f"{ended}\n{said[:2000]}"
    assert snapshot(place) == before, told
    assert ended["status"] in (0, 1, 2), told
    assert ended["seconds"] < MOST_SECONDS, told
    assert ended["memory"] < MOST_MEMORY + size(place / "bag"), told
    lines = said.splitlines()
    assert all(line.startswith(f"{tool}: ") for line in lines), told
    assert len(lines) == 1 if ended["status"] else len(lines) < MOST_LINES, told
    for text in said, (place / "out").read_bytes().decode():
        assert all(line.isprintable() for line in text.split("\n")), told


@pytest.fixture(scope="module")
def watch(tmp_path_factory):
    made = Watch(tmp_path_factory.mktemp("hostile"))
    yield made
    made.close()


# every other kind; the others are in the table of test_odd_inputs, or with the many
BRIEF = [name for name in KINDS if name not in HEAVY][::2] + [
    name for name in HEAVY if "bomb" in name
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tool"), zip(BRIEF, itertools.cycle(("analyze_bag", *QUICK)), strict=False)
)
def test_no_bag_does_harm_nor_ends_in_a_traceback(watch, name, tool):
    watch.run(name, seed=1, tool=tool)


@pytest.mark.soak
@pytest.mark.timeout(4 * 3600)
def test_none_of_many_does(watch):
    ends, times, memory = Counter(), Counter(), Counter()
    failures = []
    for seed in range(BAGS):
        kinds = list(KINDS) if seed % 8 == 0 else [name for name in KINDS if name not in HEAVY]
        name = kinds[seed * 7 // 8 % len(kinds)]
        tool = TURNS[seed // 5 % len(TURNS)]
        try:
            ended = watch.run(name, seed, spoil=seed % 3 > 0, tool=tool)
        except AssertionError as failure:
            failures.append(f"{name}, seed {seed}, {tool}: {str(failure)[:1000]}")
            print(failures[-1], flush=True)
            continue
        ends[ended["status"]] += 1
        if seed % 50 == 49:
            print(f"{seed + 1} bags, {len(failures)} failures, {dict(ends)}", flush=True)
        times[name] = max(times[name], ended["seconds"])
        memory[name] = max(memory[name], ended["memory"] >> 20)
    print(f"\n{BAGS} bags: status {dict(ends)}")
    print("longest [s]:", times.most_common(5))
    print("largest [MiB]:", memory.most_common(5))
    assert not failures
