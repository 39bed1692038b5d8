"""A parameter file for lanes over somebody's area, of whose corners alone there is a file."""

from pathlib import Path

from climber_uk.closed_loop.node_parameters import read_planner
from climber_uk.closed_loop.start import begun_at
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.messages.topics import PLANNER
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import Values


def write_for_corners(config: Path, corners: Path, path: Path) -> None:
    """Write `config` to `path`, with lanes over the area of `corners`, and a climber that is there.

    It begins where the lanes do, and drives as long as they take. Raises as `read_planner` does,
    and `ValueError` for an area that cannot be driven.
    """
    lanes = {"shape": "lanes", "lanes.area": str(corners.absolute())}
    area = {**lanes, "origin_x": 0.0, "origin_y": 0.0}  # corners are in the wall's frame
    trajectory = build_trajectory(Values(read_planner(config, f"/{PLANNER}", area)).read)
    write_changed(config, {PLANNER: area, **begun_at(trajectory)}, path)
