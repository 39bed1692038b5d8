"""Lanes over a facade with a window, as people run it: `make demo CONFIG=config/lanes.yaml`."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from world import CONFIG, executable

from climber_uk.bags.recorded_run import read_run
from climber_uk.mechanics.area import read_area
from climber_uk.mechanics.lanes import Lanes
from climber_uk.parameters.parameter_file import read_file

sys.path.append(str(Path(__file__).parents[1] / "mechanics"))
from test_lanes import covered, distance

pytestmark = [pytest.mark.nodes, pytest.mark.soak]


def off(places, line):
    """Distances (n,) of places (n, 2) from a polyline."""
    starts, ways = line[:-1], np.diff(line, axis=0)
    nearest = np.full(len(places), np.inf)
    for start, way in zip(starts, ways, strict=True):
        share = np.clip((places - start) @ way / max(way @ way, 1e-300), 0, 1)
        nearest = np.minimum(nearest, np.hypot(*(places - start - share[:, None] * way).T))
    return nearest


def test_every_lane_is_driven_and_the_window_kept_out_of(tmp_path):
    words = [
        executable("run_demo"),
        "--config",
        CONFIG / "lanes.yaml",
        "--output",
        tmp_path / "run",
    ]
    subprocess.run(words, check=True)
    run = read_run(tmp_path / "run" / "bag")
    given = read_file(CONFIG / "lanes.yaml", "/trajectory_publisher")
    lanes = Lanes(
        area=str(CONFIG / "facade.csv"),
        **{name: given[f"lanes.{name}"] for name in ("width", "clearance", "tolerance")},
    )
    places, polyline = run.pose[:, :2], lanes.given()
    assert off(polyline, places).max() <= 5e-3
    assert off(places[::10], polyline).max() <= 5e-3
    area = read_area(lanes.area, lanes.clearance)
    assert distance(places, area).min() >= lanes.clearance
    assert covered(area, places, lanes.width) >= 0.99
