"""Runs of climbers, as arrays, from the messages of a bag."""

from collections.abc import Callable, Sequence
from pathlib import Path

from climber_uk.analysis import topics
from climber_uk.analysis.bag import open_bag
from climber_uk.analysis.collecting import collect
from climber_uk.analysis.run import RecordedRun
from climber_uk.analysis.run_reader import NoRunError, RunReader, Told
from climber_uk.analysis.topics import Topics


def read_run(bag: str | Path, namespace: str = "") -> RecordedRun:
    """The one run of the climber in `namespace`; raises as `read_runs` does, and if it has more."""
    runs, _ = read_runs(bag, Topics(), [namespace])
    if len(runs) > 1:
        raise ValueError(f"{bag} has {len(runs)} runs of one climber: its time starts again")
    return runs[0]


def read_runs(
    path: str | Path,
    names: Topics,
    namespaces: Sequence[str] = (),
    parameters: Callable[[str], Told] | None = None,
    all_of_them: bool = False,
) -> tuple[list[RecordedRun], list[str]]:
    """Runs of the climbers in some namespaces (default: all), and what is to be said of the bag.

    `parameters` gives those of the controller in a namespace, else they are as the bag tells them.
    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks: any climber of
    `namespaces`, and with `all_of_them` any one that has a topic of odometry.
    """
    with open_bag(path) as bag:
        chosen = [name.strip("/") for name in namespaces] or names.namespaces(bag.types)
        collected, told = collect(bag, names, chosen)
        runs: list[RecordedRun] = []
        for namespace, found in collected.items():
            try:
                runs += RunReader(bag, names, namespace, parameters).runs(found, told)
            except NoRunError as nothing:
                bag.lose(str(nothing))
                if namespaces or all_of_them:
                    raise ValueError(f"{path}: {'; '.join(bag.losses)}") from None
        if not runs:
            if not collected:
                bag.lose(f"no odometry on a topic {topics.ODOMETRY}")
            raise ValueError(f"{path}: {'; '.join(bag.losses)}")
        return runs, bag.losses
