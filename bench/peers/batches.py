"""Batches of climbers, with their loops closed and without, beside MuJoCo's rollout.

The ways are those of `batch.py`.
"""

import batch
from limit import Limit
from peers.rollouts import MODELS, by_mujoco, inputs, named
from side_by_side import timed

SLOW = 3  # of the rounds asked for, one in so many


def compare(rounds: int) -> None:
    """Print the tables."""
    limit, given = Limit(), inputs(batch.STEPS)
    rollout = timed(lambda: by_mujoco(MODELS[0], batch.OPEN, given, threads=1))
    kinds = {f"open loop, N = {batch.OPEN}": batch.open_loop(limit, batch.installed())}
    for name, steps in batch.RATES.items():
        title = f"closed loop, N = {batch.CLOSED}, {name} / 5 ms"
        kinds[title] = batch.closed_loop(limit, batch.installed(), steps)
    for title, ways in kinds.items():
        ways[named(MODELS[0])] = batch.Way(rollout, batch.OPEN * batch.STEPS)
        batch.compared(title, ways, -(-rounds // SLOW))
