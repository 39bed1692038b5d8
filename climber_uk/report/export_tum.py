"""`export_tum BAG`: a run's poses as TUM trajectories, which evo and others read.

Lines of `stamp x y z qx qy qz qw`, in the order of the stamps: odom.tum, reference.tum with the
reference at the stamps of the odometry, and ground_truth.tum if it was recorded. Where time starts
again in the bag, each run has a directory of its own, run_1, run_2, ….
"""

import math
from pathlib import Path

import numpy as np

from climber_uk.bags.run_reader import NoRunError, RunReader
from climber_uk.bags.topics import REMAP_HINT, TYPES, Topics
from climber_uk.mechanics import SECOND, Array, Stamps
from climber_uk.messages.topics import ODOMETRY, REFERENCE, TRUTH
from climber_uk.report.outputs import add_remap, failing_in_a_line, output, parser_for_bag
from climber_uk.system.command_line import printable

Poses = tuple[Stamps, Array]  # (n,) [ns], and x, y, heading (n, 3)


def read_poses(
    bag: Path, names: Topics, namespace: str
) -> tuple[list[dict[str, Poses]], list[str]]:
    """Poses of each run by the names of their files, and the bag's losses.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    reader, found = RunReader.read(bag, names, namespace)
    topic = reader.topic(ODOMETRY)
    if not found.samples[ODOMETRY]:
        lacking = reader.bag.lacks(topic, TYPES[ODOMETRY], REMAP_HINT)
        raise ValueError("; ".join([f"{bag} has {lacking}", *reader.bag.losses]))
    runs = []
    for part in reader.split(found):
        try:
            reader.check_agreement(part)
        except NoRunError as error:
            raise ValueError(f"{bag}: {error}") from None
        odometry, truth = (reader.series(part, name) for name in (ODOMETRY, TRUTH))
        reference = reader.reference(part, odometry.stamps)
        known = np.isfinite(reference[:, 0])
        poses = {
            ODOMETRY: (odometry.stamps, odometry.values[:, :3]),
            REFERENCE: (odometry.stamps[known], reference[known]),
            TRUTH: (truth.stamps, truth.values[:, :3]),
        }
        runs.append({name: of for name, of in poses.items() if len(of[0])})
    if not any(ODOMETRY in poses for poses in runs):
        raise ValueError(f"{bag}: {'; '.join(reader.bag.losses)}")
    return runs, reader.bag.losses


def lines(poses: Poses) -> str:
    """Poses as lines of a TUM trajectory; numbers are written so that they read back exactly."""
    return "".join(
        f"{'-' * (stamp < 0)}{abs(stamp) // SECOND}.{abs(stamp) % SECOND:09} {x!r} {y!r} 0 "
        f"0 0 {math.sin(heading / 2)!r} {math.cos(heading / 2)!r}\n"
        for stamp, (x, y, heading) in zip(*(array.tolist() for array in poses), strict=True)
    )


def main() -> None:
    """Write the trajectories of a bag."""
    parser = parser_for_bag("export_tum", __doc__, "tum")
    add_remap(parser)
    options = parser.arguments()
    with (
        failing_in_a_line("export_tum") as remarks,
        output(options.bag, "tum", options.output) as directory,
    ):
        names, namespace = Topics.parse(options.remap), options.namespace.strip("/")
        runs, losses = read_poses(options.bag, names, namespace)
        remarks += [f"{options.bag}: {loss}" for loss in losses]
        for number, found in enumerate(runs, start=1):
            place = directory / f"run_{number}" if len(runs) > 1 else directory
            place.mkdir(exist_ok=True)
            for name, poses in found.items():
                (place / f"{name}.tum").write_text(lines(poses))
                print(printable(f"{place / name}.tum: {len(poses[0])} poses"))
