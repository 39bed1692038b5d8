"""Whether a simulated climber starts where its path begins, and is what its controller expects."""

import dataclasses
import math

import numpy as np

from climber_uk.control.approach import Approach
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import begun_near
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values
from climber_uk.simulation.options import SimulationOptions


def start_elsewhere(trajectory: Trajectory, controller: Values, plant: Values) -> tuple[str, bool]:
    """Words on a start elsewhere, '' if it is where the path begins; and whether it is too far.

    The controller goes to the path's beginning first, unless that is beyond `max_start_distance`.
    """
    options, start = controller.read(Approach), plant.read(SimulationOptions)
    x, y, heading = (round(number, 4) + 0.0 for number in trajectory.at(0.0).pose.tolist())
    distance = math.hypot(start.initial_x - x, start.initial_y - y)
    turn = abs(float(wrapped(start.initial_heading - heading)))
    is_too_far = distance > options.max_start_distance
    if not is_too_far and distance <= options.max_distance and turn <= options.max_heading:
        return "", False
    most = f", beyond max_start_distance ({options.max_start_distance:g} m)" if is_too_far else ""
    return (
        f"{PLANT} starts {distance:.2f} m and {turn:.2f} rad off where the path begins{most}: "
        f"there its initial_x is {x}, initial_y {y}, initial_heading {heading}"
    ), is_too_far


def begun_there(trajectory: Trajectory, start: SimulationOptions) -> Trajectory:
    """The path as the node makes it for a climber that starts there."""
    return begun_near(trajectory, np.array([start.initial_x, start.initial_y]))


def begun_at(trajectory: Trajectory) -> dict[str, dict[str, float]]:
    """Parameters by node of a climber that begins where the path does, at rest, and drives it."""
    x, y, heading = trajectory.at(0.0).pose.tolist()
    start = {"initial_x": x, "initial_y": y, "initial_heading": heading}
    return {
        PLANT: {**start, "initial_speed": 0.0, "initial_yaw_rate": 0.0},
        "run_demo": {"duration": float(math.ceil(trajectory.duration + 1.0))},
    }


def other_climber(controller: Values, plant: Values) -> str:
    """Words on parameters of the climber that the two have otherwise; '' if there are none."""
    expected, simulated = controller.read(Climber), plant.read(Climber)
    names = [
        field.name
        for field in dataclasses.fields(Climber)
        if getattr(expected, field.name) != getattr(simulated, field.name)
    ]
    said = ", ".join(
        f"{name} {getattr(expected, name)} and {getattr(simulated, name)}" for name in names
    )
    return f"{CONTROLLER} and {PLANT} have {said}" if names else ""
