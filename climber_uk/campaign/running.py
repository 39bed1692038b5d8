"""Compute the missing parts of a campaign, in processes of this computer or on a Dask cluster."""

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

Workers = tuple[Executor, int]  # and the number of parts that are submitted at a time


def run_missing(campaign: Campaign, store: Store, workers: Workers) -> None:
    """Compute and keep the missing parts, and show the progress on stderr."""
    total = campaign.size.runs
    done = total - sum(part.runs for part in store.missing)
    with tqdm(total=total, initial=done, unit=" runs", file=sys.stderr) as progress:
        for part, table in _finished(campaign, store.missing, workers):
            store.keep(part, table)
            progress.update(part.runs)


def _finished(
    campaign: Campaign, waiting: Iterator[CampaignPart], workers: Workers
) -> Iterator[tuple[CampaignPart, pa.Table]]:
    """Parts and their tables, as they are finished; no more are submitted than workers can take."""
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
    """Worker processes of this computer, which end with this process."""
    with workers(jobs) as executor:
        yield executor, 2 * jobs


@contextmanager
def cluster(address: str) -> Iterator[Workers]:
    """Workers of the Dask scheduler at `address`, which repeats what a lost worker had."""
    from distributed import Client, KilledWorker

    # pure tasks would be recognised by a hash of the campaign, which takes time
    with Client(address) as client, client.get_executor(pure=False) as executor:
        try:
            yield executor, 2 * sum(client.nthreads().values())
        except KilledWorker as error:
            raise BrokenExecutor(str(error)) from None
