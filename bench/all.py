"""`python bench/all.py` (`make bench`): every comparison in one process, with ratios and spread.

Needs what `bench/requirements.txt` lists. A comparison is a module with `compare(rounds)`.
"""

import argparse
import importlib

from side_by_side import robot

COMPARISONS = {
    "torques": "peers.torques",
    "rollouts": "peers.rollouts",
    "batches": "peers.batches",
    "accuracy": "peers.accuracy",
    "nodes": "nodes",
}


def main() -> None:
    """Print all tables, or some."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=30, help="measurements of each")
    parser.add_argument("--only", nargs="+", choices=COMPARISONS, default=list(COMPARISONS))
    options = parser.parse_args()
    if options.rounds < 1:
        parser.error(f"rounds={options.rounds} must be >= 1")
    print(robot())
    for name in options.only:
        try:
            comparison = importlib.import_module(COMPARISONS[name])
        except ModuleNotFoundError as missing:
            raise SystemExit(f"{name}: {missing}; `make bench` installs it") from None
        comparison.compare(options.rounds)


if __name__ == "__main__":
    main()
