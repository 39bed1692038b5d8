"""`export_tum BAG`: a run's poses as TUM trajectories, which evo and others read.

Lines of `stamp x y z qx qy qz qw`, in the order of the stamps: odom.tum, reference.tum with the
reference at the stamps of the odometry, and ground_truth.tum if it was recorded.
"""

import math
import sys
from contextlib import suppress
from pathlib import Path

from climber_uk.analysis.bag import read_messages
from climber_uk.analysis.topics import ODOMETRY, REFERENCE
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.preview import joined
from climber_uk.messages import reading, reading_reference
from climber_uk.system.command_line import Parser

TRUTH = "ground_truth"
Poses = dict[int, Array]  # x, y, heading by stamp [ns]


def read_poses(bag: Path, namespace: str) -> dict[str, Poses]:
    """Poses by the names of their files; those that are not finite are left out.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    prefix = f"/{namespace}/".replace("//", "/")
    topics = {prefix + name: name for name in (ODOMETRY, REFERENCE, TRUTH)}
    found: dict[str, Poses] = {ODOMETRY: {}, REFERENCE: {}, TRUTH: {}}
    previews = []
    for topic, _, message in read_messages(bag, topics):
        name, frame = topics[topic], message.header.frame_id
        with suppress(ValueError):
            if name == REFERENCE:
                previews.append(reading_reference.preview(message, frame))
            else:
                stamp = reading.nanoseconds(message.header.stamp)
                state = reading.state(message, frame, message.child_frame_id)
                found[name].setdefault(stamp, state.pose)
    if not found[ODOMETRY]:
        raise ValueError(f"{bag} has no message on {prefix}{ODOMETRY}")
    if previews:
        preview = joined(previews)
        at = {stamp: preview.at(stamp) for stamp in found[ODOMETRY]}
        found[REFERENCE] = {stamp: desired.pose for stamp, desired in at.items() if desired}
    return {name: poses for name, poses in found.items() if poses}


def lines(poses: Poses) -> str:
    """Poses as lines of a TUM trajectory, to the last bit."""
    return "".join(
        f"{stamp // SECOND}.{stamp % SECOND:09} {x!r} {y!r} 0 "
        f"0 0 {math.sin(heading / 2)!r} {math.cos(heading / 2)!r}\n"
        for stamp, pose in sorted(poses.items())
        for x, y, heading in [pose.tolist()]
    )


def main() -> None:
    """Write the trajectories of a bag."""
    parser = Parser("export_tum", __doc__)
    parser.add_argument("bag", type=Path, help="rosbag2 directory, MCAP or sqlite3")
    parser.add_argument("--namespace", default="", help="of the climber (default: none)")
    parser.add_argument("--output", "-o", type=Path, help="directory (default: tum in the bag)")
    options = parser.arguments()
    directory = options.output or options.bag / "tum"
    try:
        found = read_poses(options.bag, options.namespace)
        directory.mkdir(parents=True, exist_ok=True)
        for name, poses in found.items():
            (directory / f"{name}.tum").write_text(lines(poses))
            print(f"{directory / name}.tum: {len(poses)} poses")
    except (ValueError, OSError) as error:
        sys.exit(f"export_tum: {error}")
