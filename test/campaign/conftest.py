"""A small campaign to be changed: a tenth of a second of the paper's ellipse, without noise."""

from pathlib import Path

import pytest
import yaml

from climber_uk.campaign.campaign import read

CONFIG = Path(__file__).parents[2] / "config"
SMALL = {
    "base": str(CONFIG / "paper.yaml"),
    "runs": 100,
    "seed": 7,
    "duration": 0.1,
    "parameters": {
        "uk_torque_controller.pacing.catch_up": 0.0,
        "plant_simulator.mass": {"uniform": [4.0, 6.0]},
        "plant_simulator.initial_x": {"normal": [0.0, 0.02]},
    },
    "limits": ["max_distance < 0.03", "fell == 0"],
}


@pytest.fixture
def campaign_file(tmp_path):
    """Write the campaign with other entries and more parameters; return its path."""

    def write(parameters=None, **entries):
        tree = {**SMALL, **entries, "parameters": {**SMALL["parameters"], **(parameters or {})}}
        path = tmp_path / "small.yaml"
        path.write_text(yaml.safe_dump({k: v for k, v in tree.items() if v is not None}))
        return path

    return write


@pytest.fixture
def campaign(campaign_file):
    """Read such a campaign."""
    return lambda parameters=None, **entries: read(campaign_file(parameters, **entries))
