"""Runs of climbers, as arrays, from the messages of a bag."""

from collections.abc import Callable, Sequence
from pathlib import Path

from climber_uk.bags.bag import open_bag
from climber_uk.bags.collecting import collect
from climber_uk.bags.run import RecordedRun
from climber_uk.bags.run_reader import NoRunError, Parameters, RunReader
from climber_uk.bags.topics import REMAP_HINT, TYPES, Topics
from climber_uk.messages import topics


def read_run(bag: str | Path, namespace: str = "") -> RecordedRun:
    """Return the only run of the climber in `namespace`.

    Raises as `read_runs` does, and `ValueError` if there are several.
    """
    runs, _ = read_runs(bag, Topics(), [namespace])
    if len(runs) > 1:
        raise ValueError(f"{bag} has {len(runs)} runs of one climber: its time starts again")
    return runs[0]


def read_runs(
    path: str | Path,
    names: Topics,
    namespaces: Sequence[str] = (),
    parameters: Callable[[str], Parameters] | None = None,
    all_of_them: bool = False,
) -> tuple[list[RecordedRun], list[str]]:
    """Return runs of the climbers in some namespaces (default: all), and the bag's losses.

    `parameters` returns those of the controller in a namespace, in place of the recorded ones.
    Raises `FileNotFoundError`, or `ValueError` naming the bag and what it lacks. A climber without
    a run is an error if it was named in `namespaces`, or with `all_of_them`; else it is a loss.
    """
    with open_bag(path) as bag:
        chosen = [name.strip("/") for name in namespaces] or names.namespaces(bag.types)
        collected, reported = collect(bag, names, chosen)
        runs: list[RecordedRun] = []
        for namespace, climber in collected.items():
            try:
                runs += RunReader(bag, names, namespace, parameters).runs(climber, reported)
            except NoRunError as nothing:
                bag.lose(str(nothing))
                if namespaces or all_of_them:
                    raise ValueError(f"{path}: {'; '.join(bag.losses)}") from None
        if not runs:
            if not collected:
                name = names.remapped.get(topics.ODOMETRY, topics.ODOMETRY)
                bag.lose(f"no odometry: {bag.lacks(name, TYPES[topics.ODOMETRY], REMAP_HINT)}")
            raise ValueError(f"{path}: {'; '.join(bag.losses)}")
        return runs, bag.losses
