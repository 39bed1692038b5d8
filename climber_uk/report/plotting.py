"""Figures without a display, for all tools that draw: matplotlib, and how a figure is written."""

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

__all__ = ["plt", "saved"]


def saved(figure: Any, path: Path, dpi: float = 100) -> Path:
    """Write a figure as PNG, close it, and return the path."""
    figure.savefig(path, dpi=dpi, format="png")
    plt.close(figure)
    return path
