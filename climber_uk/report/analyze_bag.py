"""`analyze_bag BAG`: what a recorded run was like, in numbers and pictures."""

import sys
from pathlib import Path

from climber_uk.report import reporting


def main() -> None:
    """Print the table of a bag, and write its page, CSV and JSON."""
    parser = reporting.parser("analyze_bag", __doc__)
    parser.add_argument("bag", type=Path, help="rosbag2 directory or file, MCAP or sqlite3")
    options = parser.arguments()
    title = f"Run {'/'.join(options.bag.absolute().parts[-2:])}"
    sys.exit(reporting.report("analyze_bag", title, [options.bag], options))


if __name__ == "__main__":
    main()
