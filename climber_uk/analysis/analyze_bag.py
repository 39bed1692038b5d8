"""`analyze_bag BAG`: how well a recorded run tracked its reference, in numbers and pictures."""

import argparse
import sys
from pathlib import Path

from climber_uk.analysis import figures, metrics
from climber_uk.analysis.recorded_run import read_run


def main() -> None:
    """Print the table of a bag and write its figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=Path, help="rosbag2 directory, MCAP or sqlite3")
    parser.add_argument("--namespace", default="", help="of the climber (default: none)")
    parser.add_argument("--figures", type=Path, help="directory (default: figures in the bag)")
    options = parser.parse_args()
    try:
        run = read_run(options.bag, options.namespace)
    except (ValueError, OSError) as error:
        sys.exit(f"analyze_bag: {error}")
    print(metrics.table(metrics.metrics(run)))
    directory = options.figures or options.bag / "figures"
    for path in figures.draw(run, directory):
        print(path)
