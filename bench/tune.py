"""`python bench/tune.py NAME`: gains for a controller of robustness.py, by Nelder and Mead.

All have the same cost: what they have to be good at, and that they stand with delays and lags that
nobody told, those that the defaults bear.
"""

import argparse
from collections.abc import Callable
from dataclasses import astuple

import numpy as np
from identification_experiments import Scenario
from margins import CHATTER, OFF, untold
from rivals import LQR, AdaptiveGains, AdaptiveRobust, Integrating, Weights
from robustness import (
    BUILT_RUN,
    KANAYAMA,
    NOISE,
    PAPER_RUN,
    SUPER_TWISTING,
    WEIGHTS,
    Make,
    friction,
    interrupted,
    lap,
    ours,
    rival,
    slow_odometry,
)
from scipy.optimize import minimize

from climber_uk.closed_loop.simulate import Link
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer

BORNE = [  # as long as ours does
    (PAPER_RUN, Link(delay=0.0175)),
    (PAPER_RUN, Link(torque_lag=0.0325)),
    (BUILT_RUN, Link(delay=0.0225)),
    (BUILT_RUN, Link(torque_lag=0.045)),
]
PENALTY = 10.0  # [mm] for twice what would still be said to stand
WIDTH = 0.5  # of the first simplex, in logarithms of gains
LAP = 4.0  # [s]
WORST = 1e3  # [mm] of a row


def cost(make: Make) -> float:
    """Sum of RMS [mm] of short laps, and what it misses of the margins."""
    late = Link(delay=0.005)
    rows = [
        lap(make, duration=LAP),
        friction(make, duration=3 * LAP),
        lap(make, link=late, duration=LAP),
        lap(make, link=NOISE, duration=LAP),
        interrupted(make, duration=LAP)[0],
        slow_odometry(make, duration=8.0),
        *(PENALTY * missed(make, *borne) for borne in BORNE),
    ]
    return float(sum(np.nan_to_num([min(row, WORST) for row in rows], nan=WORST)))


def missed(make: Make, scenario: Scenario, link: Link) -> float:
    """By how much more than allowed it is off or chatters, as a share; 0: it stands."""
    run = untold(scenario, make(scenario.believed, scenario.guidance), link, False, LAP)
    return max(run.rms(LAP / 2) / OFF, run.chatter() / CHATTER, 1.0) - 1.0


def ours_by(gains: list[float]) -> Make:
    """Ours, with one set of gains."""
    *guidance, bandwidth = gains
    names = "frequency", "damping", "cross_track_gain"
    tuned = Guidance(**dict(zip(names, guidance, strict=True)))
    observer = Observer(bandwidth=bandwidth)
    return lambda climber, _=None, delay=0.0: ours(climber, tuned, delay, observer)


def adaptive_by(gains: list[float]) -> Make:
    """Adaptive robust control."""

    class Tuned(AdaptiveRobust):
        pass

    Tuned.gains = AdaptiveGains(*gains[:3]), AdaptiveGains(*gains[3:])
    return rival(None, Tuned)


DEFAULTS, ADAPTIVE = Guidance(), AdaptiveRobust.gains
BY: dict[str, tuple[Callable[[list[float]], Make], tuple[float, ...]]] = {
    "ours": (
        ours_by,
        (
            DEFAULTS.frequency,
            DEFAULTS.damping,
            DEFAULTS.cross_track_gain,
            Observer().bandwidth,
        ),
    ),
    "LQR": (lambda gains: rival(LQR(Weights(*gains))), astuple(WEIGHTS)),
    "Kanayama": (lambda gains: rival(type(KANAYAMA)(*gains), Integrating), astuple(KANAYAMA)),
    "super-twisting": (
        lambda gains: rival(type(SUPER_TWISTING)(*gains), Integrating),
        astuple(SUPER_TWISTING),
    ),
    "adaptive": (adaptive_by, astuple(ADAPTIVE[0]) + astuple(ADAPTIVE[1])),
}


def main() -> None:
    """Print tuned gains."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=BY)
    parser.add_argument("--tries", type=int, default=150)
    options = parser.parse_args()
    np.seterr(all="ignore")  # a rival may diverge
    make_by, gains = BY[options.name]
    start = np.log(gains)
    simplex = np.vstack([start, start + WIDTH * np.eye(len(gains))])
    best = minimize(
        lambda logs: cost(make_by(np.exp(logs).tolist())),
        start,
        method="Nelder-Mead",
        options={"maxfev": options.tries, "initial_simplex": simplex, "fatol": 0.01},
    )
    print(options.name, [f"{gain:.3g}" for gain in np.exp(best.x)], f"{best.fun:.3g}", flush=True)


if __name__ == "__main__":
    main()
