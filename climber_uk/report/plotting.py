"""Figures without a display, for all tools that draw: matplotlib, and how a figure is written."""

from pathlib import Path
from typing import IO, Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

__all__ = ["plt", "saved", "write_png"]


def saved(figure: Any, path: Path, dpi: float = 100) -> Path:
    """Write a figure as PNG, close it, and return the path."""
    write_png(figure, path, dpi)
    return path


def write_png(figure: Any, target: Path | IO[bytes], dpi: float) -> None:
    """Write a figure and close it. It is laid out once: `savefig` does so again and again."""
    figure.set_dpi(dpi)
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(target, dpi=dpi, format="png")
    plt.close(figure)
