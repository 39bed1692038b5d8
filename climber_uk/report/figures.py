"""Figures of runs, their curves over each other."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import LogLocator, NullFormatter

from climber_uk.bags.connection import one_line
from climber_uk.bags.events import ERROR, OK
from climber_uk.bags.run import RecordedRun
from climber_uk.bags.time_series import TimeSeries
from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array
from climber_uk.messages import topics
from climber_uk.report.grip import draw_grip, grip_asked
from climber_uk.report.plotting import plt, write_png

Curves = tuple[Array, Array]  # times (n,) [s] and values (n, k)
WIDTH = 9.0  # [in]
STRETCHES = 2000  # of a curve, of each of which lowest and highest value are drawn
MOST_POSES = 100_000  # of a path
RATIO = None, (1, 2, 5)
LOGARITHMIC = {"slip margin": RATIO, "tip margin": RATIO, "latency [ms]": (0.01, (1,))}
COLOURS = {OK: "tab:green", ERROR: "tab:red"}
STYLE = {
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "text.parse_math": False,  # names of bags are no formulas
}
Runs = Sequence[tuple[str, RecordedRun]]


def draw(runs: Runs) -> dict[str, bytes]:
    """Figures of named runs as PNG, by name, without those that would be empty."""
    with plt.rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=UserWarning)  # letters without a glyph, no room
        shown = [(one_line(name), run) for name, run in runs]
        return {name: _png(figure) for name, figure in _figures(shown)}


def _figures(runs: Runs) -> Iterable[tuple[str, Figure]]:
    yield "path", _path(runs)
    for name, (title, labels, curves) in CURVES.items():
        drawn = [(of, curves(run)) for of, run in runs]
        if any(np.isfinite(values).any() for _, (_, values) in drawn):
            yield name, _curves(title, labels, drawn)
    asked = [(name, grip_asked(run)) for name, run in runs]
    if any(len(shares) for _, shares in asked):
        yield "grip", _grip(asked)
    if any(run.modes for _, run in runs):
        yield "modes", _modes(runs)


def _png(figure: Figure) -> bytes:
    stream = BytesIO()
    write_png(figure, stream, dpi=110)
    return stream.getvalue()


def _path(runs: Runs) -> Figure:
    figure, axes = plt.subplots(figsize=(WIDTH, 5.5), layout="constrained")
    for label, run in runs:
        step = max(1, len(run.time) // MOST_POSES)
        (line,) = axes.plot(*run.pose[::step, :2].T, label=label, linewidth=1.5, zorder=3)
        truth = run.recorded[topics.TRUTH].values[::step, :2].T
        axes.plot(*truth, ":", color=line.get_color(), linewidth=1.5, zorder=2)
        axes.plot(*run.reference[::step, :2].T, color="0.75", linewidth=4, zorder=1)
        for pose, marker in ((run.pose[0], "o"), (run.pose[-1], "s")):
            axes.plot(*pose[:2], marker, color=line.get_color(), zorder=4)
    axes.plot([], [], color="0.75", linewidth=4, label="reference")
    if any(len(run.recorded[topics.TRUTH]) for _, run in runs):
        axes.plot([], [], ":", color="0.4", label="truth")
    for marker, meaning in (("o", "start"), ("s", "end")):
        axes.plot([], [], marker, color="0.4", label=meaning)
    axes.set(xlabel="x [m]", ylabel="y [m]", title="Path on the wall")
    axes.set_aspect("equal", adjustable="datalim")
    _legend(axes)
    return figure


def _grip(asked: Sequence[tuple[str, Array]]) -> Figure:
    figure, axes = plt.subplots(figsize=(WIDTH, 4.5), layout="constrained")
    axes.add_patch(Circle((0, 0), 1.0, facecolor="0.95", edgecolor="tab:red", zorder=1))
    for label, shares in asked:
        draw_grip(axes, label if len(asked) > 1 else "", shares)
    axes.set(xlabel="across", ylabel="along the climber")
    axes.set_title(
        "What is asked of each wheel, as a share of its grip: outside the circle it slips"
    )
    axes.set_aspect("equal", adjustable="datalim")
    _legend(axes)
    return figure


def _curves(title: str, labels: Sequence[str], drawn: Sequence[tuple[str, Curves]]) -> Figure:
    figure, grid = plt.subplots(
        len(labels),
        figsize=(WIDTH, 1.2 + 1.6 * len(labels)),
        sharex=True,
        squeeze=False,
        layout="constrained",
    )
    for i, axes in enumerate(grid[:, 0]):
        for name, (time, values) in drawn:
            axes.plot(*thinned(time, values[:, i]), label=name)
        axes.set_ylabel(labels[i])
        if labels[i] in LOGARITHMIC and any((values[:, i] > 0).any() for _, (_, values) in drawn):
            lowest, ticks = LOGARITHMIC[labels[i]]
            axes.set_yscale("log")
            if LOGARITHMIC[labels[i]] is RATIO:  # the limit, as round the grip
                axes.axhline(1.0, color="tab:red")
            axes.set_ylim(bottom=lowest)
            axes.yaxis.set_major_locator(LogLocator(subs=ticks))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_formatter(NullFormatter())
    grid[0, 0].set_title(title)
    grid[-1, 0].set_xlabel("time [s]")
    if len(drawn) > 1:
        _legend(grid[0, 0])
    return figure


def _modes(runs: Runs) -> Figure:
    height = 1.0 + 0.6 * len(runs)
    figure, axes = plt.subplots(figsize=(WIDTH, height), layout="constrained")
    for row, (_, run) in enumerate(runs):
        for mode, begin, end in run.modes:
            waits = mode.level == OK and mode.text != Mode.FOLLOWING.value
            colour = "0.75" if waits else COLOURS[mode.level]
            axes.broken_barh([(begin, end - begin)], (row - 0.3, 0.6), color=colour)
        warned = [time for time, event in run.events if event.kind != "mode" and event.level]
        axes.plot(warned, [row] * len(warned), "v", color="black", markersize=5)
    axes.set_yticks(range(len(runs)), [label for label, _ in runs])
    axes.set_ylim(len(runs) - 0.5, -0.5)
    axes.set(xlabel="time [s]")
    axes.set_title(
        "green: follows, grey: waits, red: safe output, ▾: warning or error", fontsize=10
    )
    axes.grid(axis="y", visible=False)
    return figure


def _legend(axes: Axes) -> None:
    axes.figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper")


def thinned(time: Array, values: Array) -> tuple[Array, Array]:
    """Lowest and highest value of each of `STRETCHES`, at its begin; few values as they are."""
    if len(values) <= 2 * STRETCHES:
        return time, values
    begins = np.linspace(0, len(values), STRETCHES, endpoint=False).astype(int)
    low, high = np.fmin.reduceat(values, begins), np.fmax.reduceat(values, begins)
    return np.repeat(time[begins], 2), np.stack([low, high], axis=1).ravel()


def _all_of(run: RecordedRun, series: TimeSeries) -> Curves:
    return run.seconds(series), series.values


CURVES: dict[str, tuple[str, Sequence[str], Callable[[RecordedRun], Curves]]] = {
    "errors": (
        "Tracking errors",
        ("along-track [mm]", "cross-track [mm]", "heading [mrad]"),
        lambda run: (run.time, 1e3 * run.error),
    ),
    "torques": (
        "Wheel torques",
        ("right [N m]", "left [N m]"),
        lambda run: _all_of(run, run.commands),
    ),
    "constraint_force": (
        "Udwadia-Kalaba constraint force, in the climber's frame",
        ("drive [N]", "lateral [N]", "about z [N m]"),
        lambda run: _all_of(run, run.recorded[topics.FORCE]),
    ),
    "margins": (
        "Margins: below 1 its wheels slip, or it tips over",
        ("slip margin", "tip margin"),
        lambda run: (run.seconds(run.margins), run.margins.values[:, :2]),
    ),
    "latency": (
        "From an odometry's arrival to that of its torque",
        ("latency [ms]",),
        lambda run: (run.seconds(run.commands), 1e3 * run.latency[:, None]),
    ),
}
