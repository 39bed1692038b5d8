"""A campaign read from its file, and checked as a whole before anything runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from climber_uk.campaign import names
from climber_uk.campaign.distributions import Distribution, Uniform, distribution, drawn, extremes
from climber_uk.campaign.limits import Limit
from climber_uk.campaign.names import LOSS_TIME, SEED
from climber_uk.campaign.scenario import Node, Scenario
from climber_uk.closed_loop.node_parameters import PARAMETERS, read_parameters
from climber_uk.closed_loop.period import BACKENDS
from climber_uk.mechanics import Array
from climber_uk.messages.topics import NODES, PLANT
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.parameter_file import load
from climber_uk.parameters.text_file import text_of
from climber_uk.simulation.options import SimulationOptions

SEEDS = Uniform(0, 2**31)  # of the nodes, rounded down


@parameters
class Size:
    """Number of runs, their seed, and their duration."""

    runs: int = parameter(10_000, "", "number of runs; too few: wide intervals", at_least=1)
    seed: int = parameter(0, "", "seed of all draws: the same seed, the same runs", at_least=0)
    duration: float = parameter(
        20.0, "s", "time of each run; too short: late falls unseen", above=0
    )
    backend: str = parameter(
        "numpy", "", "what computes them, an extra but numpy", choices=BACKENDS
    )


@dataclass(frozen=True)
class Campaign:
    """Values that all runs share, and distributions of the others.

    Run k depends on the seed and on k only.
    """

    base: Path  # parameter file of the nodes
    size: Size
    scenario: Scenario
    drawn: Mapping[str, Distribution]  # by the parameter's name
    limits: tuple[Limit, ...]

    def __post_init__(self) -> None:
        self.scenario.course()
        ends = {name: np.round(extremes(of), 12) for name, of in self.drawn.items()}
        self.scenario.loops({**ends, SEED: np.zeros(2, int)})  # bounds hold between, too

    def columns(self, first: int, number: int) -> dict[str, Array]:
        """Values drawn for `number` runs from `first` on, (number,) by the parameter's name."""
        own: dict[str, Any] = {
            name: drawn(of, self.size.seed, name, first, number) for name, of in self.drawn.items()
        }
        if LOSS_TIME in own:
            own[LOSS_TIME] = self._on_grid(own[LOSS_TIME])
        own[SEED] = drawn(SEEDS, self.size.seed, SEED, first, number).astype(int)
        return own

    def described(self) -> dict[str, str]:
        """Everything that the results depend on, as strings by name."""
        size, shared = vars(self.size), self.scenario.values
        return {
            "climber_uk": version("climber_uk"),
            **{name: repr(value) for name, value in {**size, **shared, **self.drawn}.items()},
            "limits": ", ".join(map(str, self.limits)),
        }

    def _on_grid(self, times: Array) -> Array:
        """Times [s] moved to the next begin of a control period, as nodes act on them."""
        period = Node(PLANT, self.scenario.values).read(SimulationOptions).control_period
        return np.round(np.ceil(times / period) * period, 9)


def read(path: Path, runs: int | None = None) -> Campaign:
    """Campaign of a file, with `runs` in place of the file's if given.

    Raises `OSError`, or `ValueError` naming the file and what is wrong in it.
    """
    try:
        tree = load(text_of(path))
        return _campaign(tree, path.parent, {} if runs is None else {"runs": runs})
    except (yaml.YAMLError, ValueError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def _campaign(tree: Any, directory: Path, instead: dict[str, int]) -> Campaign:
    """Campaign of a file's content; `instead` replaces entries of it."""
    if not isinstance(tree, dict):
        raise ValueError("must have base, parameters and limits")
    given = {**tree, **instead}
    base = directory / str(given.pop("base", "base is missing"))
    parameters = given.pop("parameters", {})
    limits = given.pop("limits", [])
    if not (isinstance(parameters, dict) and isinstance(limits, list) and limits):
        raise ValueError("parameters must be names with values, limits a list with one at least")
    size = _size(given)
    shared, own = _read_base(base), {}
    for name, value in parameters.items():
        if not isinstance(value, dict) or [*value] == ["fixed"]:
            plain = value["fixed"] if isinstance(value, dict) else value
            shared[name] = names.fixed(name, plain)
            continue
        try:
            own[name] = distribution(value)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    for name in own:
        names.check_drawn(name, shared)
    scenario = Scenario(shared, size.duration, size.backend)
    return Campaign(base, size, scenario, own, tuple(Limit.read(str(text)) for text in limits))


def _size(given: dict[str, Any]) -> Size:
    for name, value in given.items():
        if name not in Size.__dataclass_fields__:
            known = ", ".join(("base", *Size.__dataclass_fields__, "parameters", "limits"))
            raise ValueError(f"{name} is not one of {known}")
        default = getattr(Size, name)
        given[name] = names.typed(name, value, default)
    return Size(**given)


def _read_base(path: Path) -> dict[str, Any]:
    """Values of the nodes' parameter file, by full name."""
    return {
        f"{node}.{name}": value
        for node in NODES
        for name, value in read_parameters(path, f"/{node}").items()
        if f"{node}.{name}" in PARAMETERS
    }
