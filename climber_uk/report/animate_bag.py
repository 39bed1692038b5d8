"""`animate_bag BAG`: the climber moving on its wall, with torques, margins and errors."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Polygon
from PIL import Image
from tqdm import tqdm

from climber_uk.bags.collecting import PROGRESS_DELAY
from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.run import RecordedRun
from climber_uk.bags.topics import Topics
from climber_uk.mechanics import Array
from climber_uk.report.figures import STYLE, thinned
from climber_uk.report.outputs import add_remap, failing_in_a_line, output, parser_for_bag
from climber_uk.report.plotting import plt
from climber_uk.system.command_line import between, printable

SIZE, DPI = (8.0, 4.2), 90  # [in]
FORMATS = "webp", "gif"
QUALITY = 60  # of WebP, of 100
# Outline in lengths of the climber, x forwards: a wedge, so that one sees where it goes
OUTLINE = np.array([[-0.5, -0.4], [0.3, -0.4], [0.6, 0.0], [0.3, 0.4], [-0.5, 0.4]])
SMALLEST = 0.05  # of the picture, that a climber is drawn at least
STANDING = 0.1  # [m] of a climber of unknown size that goes nowhere
RIGHT, LEFT = "tab:blue", "tab:orange"


class Film:
    """Pictures of a run at any time."""

    def __init__(self, run: RecordedRun) -> None:
        self.run = run
        self.figure = plt.figure(figsize=SIZE, dpi=DPI, layout="constrained")
        grid = self.figure.add_gridspec(3, 2, width_ratios=(1.3, 1.0))
        self.wall = self.figure.add_subplot(grid[:, 0])
        reference = run.reference[:: max(1, len(run.time) // 2000)]
        self.wall.plot(*reference[:, :2].T, color="0.8", linewidth=4)
        (self.way,) = self.wall.plot([], [], color=RIGHT, linewidth=1.5)
        places = np.concatenate([run.pose[:, :2], reference[np.isfinite(reference[:, 0]), :2]])
        low, high = places.min(axis=0), places.max(axis=0)
        track = 2 * run.climber.half_track if run.climber else 0.0
        self.length = max(track, SMALLEST * float((high - low).max())) or STANDING
        self.body = self.wall.add_patch(Polygon(OUTLINE, facecolor="0.3", zorder=3))
        (left, bottom), (right, top) = low - self.length, high + self.length
        self.wall.set(xlim=(left, right), ylim=(bottom, top))
        self.wall.set(xlabel="x [m]", ylabel="y, up the wall [m]")
        self.wall.set_aspect("equal")
        torques = run.seconds(run.commands), run.commands.values[:, :2]
        margins = run.seconds(run.margins), run.margins.values[:, :1]
        distance = run.time, 1e3 * run.distance[:, None]
        curves = {"torques [N m]": torques, "slip margin": margins, "off the path [mm]": distance}
        self.cursors = [
            self._curves(self.figure.add_subplot(grid[row, 1]), label, *drawn)
            for row, (label, drawn) in enumerate(curves.items())
        ]
        self.cursors[-1].axes.set_xlabel("time [s]", fontsize=8)

    @staticmethod
    def _curves(axes: Any, label: str, time: Array, values: Array) -> Any:
        """Draw curves of (n,) [s] and (n, k), and a line that shows the time; return that."""
        wheels = zip(values.T, (RIGHT, LEFT), (2.0, 1.0), ("right", "left"), strict=False)
        for column, colour, width, name in wheels:
            axes.plot(*thinned(time, column), color=colour, linewidth=width, label=name)
        if values.shape[1] > 1:
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=7, ncols=2)
        axes.set_ylabel(label, fontsize=8)
        axes.tick_params(labelsize=7)
        return axes.axvline(0.0, color="0.3")

    def at(self, time: float) -> Image.Image:
        """Picture of a time [s] of the run."""
        run = self.run
        now = min(int(np.searchsorted(run.time, time)), len(run.time) - 1)
        x, y, heading = run.pose[now].tolist()
        step = max(1, now // 2000)
        self.way.set_data(run.pose[: now + 1 : step, 0], run.pose[: now + 1 : step, 1])
        cosine, sine = math.cos(heading), math.sin(heading)
        turned = OUTLINE @ np.array([[cosine, sine], [-sine, cosine]])
        self.body.set_xy(self.length * turned + [x, y])
        for cursor in self.cursors:
            cursor.set_xdata([time, time])
        speed = math.hypot(*run.rates[now, :2])
        self.wall.set_title(f"{time:6.1f} s   {speed:.2f} m/s", family="monospace", fontsize=10)
        self.figure.canvas.draw()
        return Image.fromarray(np.asarray(self.figure.canvas.buffer_rgba())[:, :, :3].copy())


def pictures(run: RecordedRun, number: int) -> Iterator[Image.Image]:
    """So many pictures of a whole run, evenly in its time."""
    with plt.rc_context(STYLE):
        film = Film(run)
        for time in np.linspace(0.0, run.time[-1], number):
            yield film.at(float(time))
        plt.close(film.figure)


def write(run: RecordedRun, path: Path, seconds: float, rate: float) -> int:
    """Write a film of a run; return how many pictures it has."""
    number, duration = max(2, round(seconds * rate)), round(1000 / rate)  # [ms]
    drawn = tqdm(
        pictures(run, number),
        desc=path.name,
        total=number,
        unit=" pictures",
        delay=PROGRESS_DELAY,
        leave=False,
        disable=None,
    )
    first, *others = drawn
    first.save(
        path, save_all=True, append_images=others, duration=duration, loop=0, quality=QUALITY
    )
    return 1 + len(others)


def main() -> None:
    """Write a film of each run of a bag."""
    parser = parser_for_bag("animate_bag", __doc__, "film")
    parser.add_argument("--format", choices=FORMATS, default=FORMATS[0], help="of the file")
    parser.add_argument(
        "--seconds",
        type=between(0.1, 600.0),
        default=10.0,
        help="length of the film (default: %(default)s)",
    )
    parser.add_argument(
        "--rate",
        type=between(1.0, 50.0),
        default=12.0,
        help="pictures a second (default: %(default)s)",
    )
    add_remap(parser)
    options = parser.arguments()
    with (
        failing_in_a_line("animate_bag") as remarks,
        output(options.bag, "film", options.output) as directory,
    ):
        runs, losses = read_runs(options.bag, Topics.parse(options.remap), [options.namespace])
        remarks += [f"{options.bag}: {loss}" for loss in losses]
        for number, run in enumerate(runs, start=1):
            name = f"film_{number}" if len(runs) > 1 else "film"
            path = directory / f"{name}.{options.format}"
            count = write(run, path, options.seconds, options.rate)
            print(printable(f"{path}: {count} pictures"))


if __name__ == "__main__":
    main()
