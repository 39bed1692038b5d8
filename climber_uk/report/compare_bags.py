"""`compare_bags A B …`: recorded runs side by side, with ratios to the first."""

import sys
from pathlib import Path

from climber_uk.report import reporting
from climber_uk.report.tables import text


def main() -> None:
    """Print the table of some bags, and write their page, CSV and JSON."""
    parser = reporting.parser("compare_bags", __doc__)
    parser.add_argument("first", type=Path, help="rosbag2 directory or file, MCAP or sqlite3")
    parser.add_argument("others", type=Path, nargs="+", help="what is compared with it")
    options = parser.arguments()
    bags = [options.first, *options.others]
    sys.exit(reporting.report("compare_bags", "Comparison of runs", bags, options, text))


if __name__ == "__main__":
    main()
