"""From the corners of an area to parameters by which a climber begins and ends with its lanes."""

from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.start import begun_there
from climber_uk.demo.corners import write_for_corners
from climber_uk.demo.run_demo import DemoOptions, remarks_on
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.simulation.options import SimulationOptions

CONFIG = Path(__file__).parents[2] / "config"


@pytest.mark.parametrize("config", ["lanes.yaml", "climber.yaml"])
def test_a_climber_begins_where_its_lanes_do_and_drives_them_to_their_end(tmp_path, config):
    corners, written = tmp_path / "my wall.csv", tmp_path / "run" / "corners.yaml"
    corners.write_text("7;5\n9;5\n9;5,7\n7;5,9\n")
    written.parent.mkdir()
    write_for_corners(CONFIG / config, corners, written)
    planner, plant, demo = (
        Values(read_file(written, f"/{node}"))
        for node in ("trajectory_publisher", "plant_simulator", "run_demo")
    )
    path, start = build_trajectory(planner.read), plant.read(SimulationOptions)
    assert begun_there(path, start) is path
    np.testing.assert_allclose(start.initial_state.pose, path.at(0.0).pose)
    assert not start.initial_state.velocity.any()
    assert path.duration + 1 <= demo.read(DemoOptions).duration <= path.duration + 2
    assert not remarks_on(written, "", is_refused=True)
    x, y = path.path(1000)[:, :2].T
    assert (x.min() > 7.1, x.max() < 8.9, y.min() > 5.1, y.max() < 5.8) == (True,) * 4
    assert plant.by_name["mass"] == 5.0


def test_an_area_that_is_none_is_refused_with_its_line(tmp_path):
    corners = tmp_path / "mine.csv"
    corners.write_text("0 0\n3 0\n3 x\n")
    with pytest.raises(ValueError, match=r"mine.csv.*line 3: 'x' must be a number"):
        write_for_corners(CONFIG / "lanes.yaml", corners, tmp_path / "corners.yaml")
