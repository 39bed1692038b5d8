"""Run what is missing of a campaign: in processes of this machine, or on a Dask cluster."""

import sys
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from itertools import islice

import pyarrow as pa
from tqdm import tqdm

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.parts import CampaignPart, Store, computed
from climber_uk.system.workers import workers

Workers = tuple[Executor, int]  # and how many parts they may have in hand at a time


def run_missing(campaign: Campaign, store: Store, workers: Workers) -> None:
    """Keep each part as it is finished, and tell the time that is left."""
    total = campaign.size.runs
    done = total - sum(part.runs for part in store.missing)
    with tqdm(total=total, initial=done, unit=" runs", file=sys.stderr) as progress:
        for part, table in _finished(campaign, store.missing, workers):
            store.keep(part, table)
            progress.update(part.runs)


def _finished(
    campaign: Campaign, waiting: Iterator[CampaignPart], workers: Workers
) -> Iterator[tuple[CampaignPart, pa.Table]]:
    """Parts in the order in which they are finished; no more are in hand than workers can take."""
    executor, at_once = workers
    in_hand = dict[Future[pa.Table], CampaignPart]()
    while True:
        for part in islice(waiting, at_once - len(in_hand)):
            in_hand[executor.submit(computed, campaign, part.first, part.runs)] = part
        if not in_hand:
            return
        for future in wait(in_hand, return_when=FIRST_COMPLETED).done:
            yield in_hand.pop(future), future.result()


@contextmanager
def processes(jobs: int) -> Iterator[Workers]:
    """Processes of this machine, which end when this one does, however it ends."""
    with workers(jobs) as executor:
        yield executor, 2 * jobs


@contextmanager
def cluster(address: str) -> Iterator[Workers]:
    """Workers of the Dask scheduler at `address`, which computes again what a lost one had."""
    from distributed import Client, KilledWorker

    # pure tasks would be recognised by a hash of the campaign, which nobody needs
    with Client(address) as client, client.get_executor(pure=False) as executor:
        try:
            yield executor, 2 * sum(client.nthreads().values())
        except KilledWorker as error:
            raise BrokenExecutor(str(error)) from None
