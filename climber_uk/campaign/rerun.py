"""A run of a campaign repeated by the nodes: parameter file, bag and figures."""

import sys
from pathlib import Path
from typing import Any

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.limits import METRICS
from climber_uk.campaign.names import MEASURED, PRESSURE, WITHOUT
from climber_uk.campaign.parts import computed
from climber_uk.closed_loop.node_parameters import PARAMETERS
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.system.processes import call


def rerun(campaign: Campaign, run: int, output: Path) -> int:
    """Repeat a run with `run_demo` in a new directory, and analyse its bag; return the status."""
    output.mkdir(parents=True)
    config, demo = output / "parameters.yaml", output / "demo"
    write_changed(campaign.base, parameters(campaign, run), config)
    row = computed(campaign, run, 1).to_pylist()[0]
    print(f"run {run} in the campaign: {row['verdict']}")
    for name, (unit, _) in METRICS.items():
        print(f"{name:<28} {row[name]:>12.6g} {unit}", flush=True)
    duration = str(campaign.size.duration)
    for command in (
        ["run_demo", "--config", str(config), "--output", str(demo), "--duration", duration],
        ["analyze_bag", str(demo / "bag")],
    ):
        if status := call([Path(sys.argv[0]).parent / command[0], *command[1:]]):
            return status
    return 0


def parameters(campaign: Campaign, run: int) -> dict[str, dict[str, Any]]:
    """Parameters of a run, by node and name."""
    own = {name: column.tolist()[0] for name, column in campaign.columns(run, 1).items()}
    values = {**WITHOUT, **campaign.scenario.values, **own}
    values[MEASURED] = values.get(PRESSURE, PARAMETERS[PRESSURE].default)
    by_node: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        node, _, parameter = name.partition(".")
        by_node.setdefault(node, {})[parameter] = value
    return by_node
