"""`python bench/identify.py`: how near identification comes to a truth that is known.

Mass, inertia and friction each 30 % more or less than the controller believes, odometry with noise
of 1 mm, 1 mrad, 10 mm/s and 10 mrad/s; another noise and another truth with each seed.
"""

import argparse
import os
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np

from climber_uk.analysis.identification_experiments import (
    OFF,
    SCENARIOS,
    as_identified,
    errors,
    identified,
)


def trial(name: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Relative errors (3,) of a seed, and whether the truth is in the intervals (3,)."""
    return errors(*identified(SCENARIOS[name], seed))


def tracking(name: str, seed: int) -> float:
    """RMS error with the parameters identified, in multiples of that with the true ones."""
    scenario = SCENARIOS[name]
    true, found = identified(scenario, seed)
    return scenario.tracks(as_identified(scenario.believed, found), true) / scenario.tracks(
        true, true
    )


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
            for number, parameter in enumerate(OFF):
                rms = np.sqrt(np.mean(off[:, number] ** 2))
                print(
                    f"{name:14}{parameter:28}error rms {rms:.3%}, largest "
                    f"{np.abs(off[:, number]).max():.3%}, in the interval "
                    f"{inside[:, number].sum()} of {options.seeds}",
                    flush=True,
                )
            ratios = list(pool.map(partial(tracking, name), range(min(5, options.seeds))))
            print(f"{name:14}tracking at worst {max(ratios):.3f} of that with the true parameters")


if __name__ == "__main__":
    main()
