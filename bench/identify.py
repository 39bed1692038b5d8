"""`python bench/identify.py`: how near identification comes to a truth that is known.

Mass, inertia and friction each 30 % more or less than the controller believes, odometry with noise
of 1 mm, 1 mrad, 10 mm/s and 10 mrad/s; another noise and another truth with each seed. What is not
told counts as neither right nor wrong.
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from identification_experiments import (
    OFF,
    SCENARIOS,
    as_identified,
    errors,
    identified,
    scrub_error,
)


def trial(name: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors (4,) of a seed, nan if not told, and whether they are in the intervals (4,).

    The last is what resists turning, in N m.
    """
    true, found = identified(SCENARIOS[name], seed)
    off, inside = errors(true, found)
    scrub, is_inside = scrub_error(SCENARIOS[name], true, found)
    return np.append(off, scrub), np.append(inside, is_inside)


def tracking(name: str, seed: int) -> float:
    """RMS error with the parameters identified, in multiples of that with the true ones."""
    scenario = SCENARIOS[name]
    true, found = identified(scenario, seed)
    return scenario.tracks(as_identified(scenario.believed, found), true) / scenario.tracks(
        true, true
    )


def said(off: np.ndarray, inside: np.ndarray, form: str) -> str:
    """In how many seeds it was told, how well, and in how many of these the interval was right."""
    told = np.isfinite(off)
    if not told.any():
        return "never told"
    rms, largest = np.sqrt(np.mean(off[told] ** 2)), np.abs(off[told]).max()
    right = f"in the interval {inside[told].sum()} of {told.sum()}"
    return f"error rms {rms:{form}}, largest {largest:{form}}, {right}, not told {(~told).sum()}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="how many (default: 100)")
    parser.add_argument("--only", choices=tuple(SCENARIOS), help="one of the scenarios")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(2) as pool:
        for name in [options.only] if options.only else SCENARIOS:
            results = list(pool.map(partial(trial, name), range(options.seeds)))
            off, inside = (np.array(column) for column in zip(*results, strict=True))
            for number, parameter in enumerate((*OFF, "turning_friction")):
                form = ".3%" if parameter in OFF else ".2g"  # N m
                words = said(off[:, number], inside[:, number], form)
                print(f"{name:14}{parameter:28}{words}", flush=True)
            ratios = list(pool.map(partial(tracking, name), range(min(5, options.seeds))))
            print(f"{name:14}tracking at worst {max(ratios):.3f} of that with the true parameters")


if __name__ == "__main__":
    main()
