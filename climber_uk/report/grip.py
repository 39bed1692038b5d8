"""How much of its grip is asked of each wheel: the friction circle of both (§7)."""

import numpy as np
from matplotlib.axes import Axes

from climber_uk.bags.run import RecordedRun
from climber_uk.control.build import known_wall
from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import Attachment, Grip
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.wall import weight
from climber_uk.messages import topics
from climber_uk.parameters.parameter_file import Values

MOST = 20_000  # points of a wheel
SIDES = ("right wheel", "-"), ("left wheel", ":")
BEYOND = 2.0  # times the grip, to which what is drawn is clipped


def grip_asked(run: RecordedRun) -> Array:
    """Shares (k, 2, 2) of the right and the left wheel's grip that are asked for: across, along.

    At each torque of which the constraint force was recorded; a norm above 1 slips. Empty without
    parameters of the controller, or margins, whose load on the wheels it takes.
    """
    climber, force = run.climber, run.recorded[topics.FORCE]
    if climber is None or not len(force) or not len(run.margins):
        return np.zeros((0, 2, 2))
    _, torque, lateral = np.intersect1d(run.commands.stamps, force.stamps, return_indices=True)
    time = run.seconds(force)[lateral]
    load = np.interp(time, run.seconds(run.margins), run.margins.values[:, 2])
    heading = np.interp(time, run.time, np.unwrap(run.pose[:, 2]))
    grip = Values(run.parameters).read(Grip)
    x, y = (np.interp(time, run.time, run.pose[:, axis]) for axis in (0, 1))
    there = Motion.at(x, y, heading, 0.0, 0.0)
    _, across = weight(known_wall(Values(run.parameters)), climber, there)
    sides = np.stack(Attachment(grip=grip).wheel_loads(climber, load, across), axis=-1)
    most = np.maximum(grip.wheel_friction_coefficient * sides, 1e-9)
    along = run.torques[torque] / climber.wheel_radius / most
    shares = force.values[lateral, 1] / np.maximum(load, 1e-9) / grip.wheel_friction_coefficient
    return np.stack([np.repeat(shares[:, None], 2, axis=1), along], axis=-1)


def draw_grip(axes: Axes, label: str, asked: Array) -> None:
    """Draw the shares (k, 2, 2) of a run, named `label`, into the circle of what there is."""
    shown = np.clip(asked[:: max(1, len(asked) // MOST)], -BEYOND, BEYOND)
    colour = None
    for side, (name, style) in enumerate(SIDES):
        (line,) = axes.plot(*shown[:, side].T, style, color=colour, label=f"{label} {name}".strip())
        colour = line.get_color() if label else None
