import json

import pytest
from world import World

from climber_uk.replay import replay_controller


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.close()


@pytest.fixture
def replay(monkeypatch, tmp_path):
    """Numbers that `replay_controller` writes about a bag, for some arguments."""

    def run(bag, *arguments):
        words = "replay_controller", bag, "--output", tmp_path / "replay", *arguments
        monkeypatch.setattr("sys.argv", [str(word) for word in words])
        replay_controller.main()
        return json.loads((tmp_path / "replay" / "replay.json").read_text())

    return run
