"""The picture of a path: where on it how much is left of what limits it most."""

from math import dist
from pathlib import Path

import numpy as np

from climber_uk.path_check.demands import Demands
from climber_uk.report.plotting import plt, saved

ENOUGH = 5.0  # of a reserve: more is not told apart
LABELS_APART = 0.05  # of the path's size, below which places share one


def draw(found: Demands, path: Path) -> Path:
    """Write a picture of the path by its least reserve, and of all reserves along it."""
    figure, (above, below) = plt.subplots(2, 1, figsize=(9, 9), height_ratios=(2, 1))
    least = np.min([*found.reserves.values()], axis=0).clip(0.0, ENOUGH)
    drawn = above.scatter(*found.pose[:, :2].T, c=least, s=6, cmap="RdYlGn", vmin=0.0, vmax=ENOUGH)
    figure.colorbar(drawn, ax=above, label="least reserve: allowed by asked for")
    named: dict[tuple[float, float], list[str]] = {}
    apart = LABELS_APART * np.ptp(found.pose[:, :2])
    for at in found.least():
        near = next((place for place in named if dist(place, at.place) < apart), at.place)
        named.setdefault(near, []).append(at.name)
    middle = np.mean([found.pose[:, 0].min(), found.pose[:, 0].max()])
    for place, names in named.items():
        side = "left" if place[0] < middle else "right"
        above.annotate("; ".join(names), place, fontsize=8, ha=side)
    above.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    for name, reserve in found.reserves.items():
        below.plot(found.distance, reserve.clip(0.0, ENOUGH), label=name)
    below.axhline(1.0, color="k", linewidth=0.8)
    below.set(xlabel="along the path [m]", ylabel="reserve", ylim=(0, ENOUGH))
    below.legend(loc="upper right", fontsize=8)
    figure.tight_layout()
    return saved(figure, path)
