"""A run as a film."""

import sys

import numpy as np
import pytest
from made_bag import a_run
from PIL import Image

from climber_uk.report import animate_bag

pytestmark = pytest.mark.slow  # figures are


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    made = a_run(200)
    made.add_vectors("plant_simulator/margins", [[2.0, 3.0, 80.0]])
    return made.write(tmp_path_factory.mktemp("film") / "bag")


@pytest.fixture
def run(monkeypatch, capsys):
    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["animate_bag", *map(str, arguments)])
        animate_bag.main()
        return capsys.readouterr().out

    return run


@pytest.mark.parametrize("kind", ["webp", "gif"])
def test_the_pictures_of_a_film_differ_and_are_as_many_as_asked_for(bag, run, tmp_path, kind):
    path = tmp_path / f"film.{kind}"
    few = "--seconds", "0.5", "--rate", "6", "--format", kind, "--output", tmp_path
    assert run(bag, *few) == f"{path}: 3 pictures\n"
    with Image.open(path) as film:
        assert film.n_frames == 3
        seen = []
        for number in range(3):
            film.seek(number)
            seen.append(np.asarray(film.convert("L"), float))
    assert all(np.ptp(picture) > 200 for picture in seen)
    assert abs(seen[0] - seen[2]).max() > 100


def test_without_a_directory_it_is_a_new_one_in_the_bag(bag, run):
    few = "--seconds", "0.2", "--rate", "5"
    said = run(bag, *few) + run(bag, *few)
    assert said == "".join(f"{bag}/{name}/film.webp: 2 pictures\n" for name in ("film", "film_2"))


def test_a_bag_without_a_run_is_one_line(run, tmp_path, capsys):
    with pytest.raises(SystemExit, match="2"):
        run(tmp_path / "nowhere", "--output", tmp_path)
    said = capsys.readouterr().err
    assert said == f"animate_bag: there is no bag {tmp_path}/nowhere\n"
