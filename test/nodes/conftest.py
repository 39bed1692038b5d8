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
def replay(monkeypatch, tmp_path, capsys):
    """Numbers that `replay_controller` writes about a bag, for some arguments.

    Where it ends with an error, `SystemExit` has what it said.
    """

    def run(bag, *arguments):
        words = "replay_controller", bag, "--output", tmp_path / "replay", *arguments
        monkeypatch.setattr("sys.argv", [str(word) for word in words])
        try:
            replay_controller.main()
        except SystemExit as ended:
            if ended.code == 2:
                raise SystemExit(capsys.readouterr().err) from None
            raise
        return json.loads((tmp_path / "replay" / "replay.json").read_text())

    return run
