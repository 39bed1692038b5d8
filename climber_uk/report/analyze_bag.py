"""`analyze_bag BAG`: what a recorded run was like, in numbers and pictures."""

import sys
from pathlib import Path

from climber_uk.report import cards, reporting, tables


def main() -> None:
    """Print a bag at a glance, or its table, and write its page, CSV and JSON."""
    parser = reporting.parser("analyze_bag", __doc__)
    parser.add_argument("bag", type=Path, help="rosbag2 directory or file, MCAP or sqlite3")
    parser.add_argument("--all", action="store_true", help="print all metrics, as a table")
    options = parser.arguments()
    title = f"Run {'/'.join(options.bag.absolute().parts[-2:])}"
    text = tables.text if options.all else cards.text
    sys.exit(reporting.report("analyze_bag", title, [options.bag], options, text))


if __name__ == "__main__":
    main()
