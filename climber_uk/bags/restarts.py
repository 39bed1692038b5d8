"""Whether a recording is of one run, or of several, one after the other or at once.

Time starts again where the simulation is started again, or the clock is set back. All of it is
judged by the stamps and positions of one topic, in the order of arrival.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from climber_uk.mechanics import SECOND, Array, Stamps

AROUND = 5  # messages before and after, by which a restart is recognised
RECENT = 16  # messages before, that may be of the same time as those after a restart
TWICE = 1.5  # times as many messages as usual in a time of which there are messages twice
JITTER = 0.4  # [periods] of stamps
AT_LEAST = 2  # messages that go on: fewer are late
TOLERANCE = SECOND  # by which a stamp may be off those around it
STRAY_PERIODS = 5  # the same, in periods
MOST_STRAY = 0.1  # share of the messages
APART, OFTEN = 0.05, 5  # [m] and number of messages: from then on they are not of one climber
NEAR, RETURNING = 0.2, 0.75  # share of a leap, and of all leaps


def restarts(stamps: Stamps) -> list[int]:
    """Places in the stamps (n,) of one topic, in the order of arrival, where they start again.

    There the next few stamps all lie before most of the last few, or among them as a second set of
    the same time, and rise. A message that comes late, or with a wrong stamp, lies back or ahead
    too, but those around it do not, and it fills a gap.
    """
    different = np.flatnonzero(np.diff(stamps, prepend=stamps[:1] - 1))
    stamps = stamps[different]
    steps = np.diff(stamps)
    period = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
    found: list[int] = []
    for i in (np.flatnonzero(steps < 0) + 1).tolist():
        is_new = not found or i - found[-1] >= AROUND
        before, after = stamps[max(0, i - RECENT, *found[-1:]) : i], stamps[i : i + AROUND]
        if is_new and (_lies_back(before, after, period) or _repeats_time(before, after, period)):
            found.append(i)
    return [int(different[i]) for i in found]


def _lies_back(before: Stamps, after: Stamps, period: float) -> bool:
    last, steps = np.sort(before[-AROUND:]), np.diff(after)
    goes_on = after[-1] >= after[0]
    if len(after) < AROUND:  # at the end of the recording, where late ones may be left over
        goes_on = len(after) > AT_LEAST and (abs(steps - period) < TWICE * period).all()
    return bool(goes_on and after.max() < last[len(last) // 2])


def _repeats_time(before: Stamps, after: Stamps, period: float) -> bool:
    """Whether there were messages before of the time after a small step back."""
    beyond = np.append(after > before.max() + JITTER * period, True)
    after = after[: int(np.argmax(beyond))]
    if len(after) < AT_LEAST or (np.diff(after) < 0).any():
        return False
    first, last = after[0] - JITTER * period, after[-1] + JITTER * period
    within = np.sum((before >= first) & (before <= last))
    expected = float(after[-1] - after[0]) / period + 1
    return bool(len(after) + within > TWICE * expected)


def windows(stamps: Stamps, arrivals: Stamps) -> list[tuple[float, float]]:
    """Log times [ns] between which each run was recorded, by messages in the order of arrival.

    One window without end, if the stamps alternate between clocks: then `disagreement` says so.
    """
    if are_mixed(stamps):
        return [(-np.inf, np.inf)]
    borders = [(int(arrivals[i - 1]) + int(arrivals[i]) + 1) // 2 for i in restarts(stamps)]
    return list(pairwise([-np.inf, *borders, np.inf]))


def are_strays(stamps: Stamps) -> NDArray[np.bool]:
    """Which of the stamps (n,), in the order of arrival, are far off those around them."""
    if len(stamps) <= AROUND:
        return np.zeros(len(stamps), bool)
    padded = np.pad(stamps, AROUND // 2, "reflect")
    around = np.sort(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    period = float(np.median(np.abs(np.diff(stamps))))
    tolerance = max(TOLERANCE, STRAY_PERIODS * period)
    return np.asarray(np.abs(stamps - around[:, AROUND // 2]) > tolerance)


def are_many(strays: NDArray[np.bool]) -> bool:
    """Whether so many stamps are strays that they are no accident."""
    return bool(np.sum(strays) >= max(OFTEN, MOST_STRAY * len(strays)))


def are_mixed(stamps: Stamps) -> bool:
    """Whether stamps (n,) in the order of arrival alternate between two clocks, or more."""
    return are_many(are_strays(stamps)) or _leaps(stamps[:, None], TOLERANCE) > 0


def are_copies(stamps: Stamps, values: Array) -> NDArray[np.bool]:
    """Which messages (n,) repeat one shortly before: the same stamp, the same values (n, k).

    Those of a run that is repeated as a whole come long after, and are none.
    """
    _, first, same = np.unique(stamps, return_index=True, return_inverse=True)
    before, here = first[same], np.arange(len(stamps))
    is_equal = ((values == values[before]) | np.isnan(values)).all(axis=1)
    return np.asarray((before < here) & (here <= before + RECENT) & is_equal)


def disagreement(stamps: Stamps, places: Array) -> str:
    """Why messages in the order of arrival are not of one run, in words; empty if they may be.

    `places` (n, 2) are their positions [m]. Messages of two runs alternate where two plants run at
    once, or where a second run has the log times of the first.
    """
    why = "two runs, or two publishers"
    _, first, same = np.unique(stamps, return_index=True, return_inverse=True)
    apart = np.hypot(*(places - places[first[same]]).T) > APART
    if (count := int(np.sum(apart))) >= OFTEN:
        return f"{count} messages are more than {APART:g} m from another with the same stamp: {why}"
    if are_mixed(stamps):
        return f"its stamps leap to and fro by more than {TOLERANCE // SECOND} s: {why}"
    for order in np.arange(len(stamps)), np.argsort(stamps, kind="stable"):
        if count := _leaps(places[order], APART):
            return f"it leaps to and fro {count} times, by more than {APART:g} m: {why}"
    return ""


def _leaps(track: Array | Stamps, least: float) -> int:
    """How often messages (n, k) leap between a few curves, by more than `least`; 0: not at all."""
    steps = np.linalg.norm(np.diff(track, axis=0), axis=1)
    leaps = np.flatnonzero(steps > least)
    if len(leaps) < OFTEN:
        return 0
    landed, left, size = track[leaps + 1], track[leaps], steps[leaps][3:]
    gaps = [np.linalg.norm(landed[3:] - landed[3 - ago : -ago], axis=1) for ago in (2, 3)]
    moved = np.linalg.norm(left[3:] - landed[2:-1], axis=1)  # between two leaps
    back = (np.minimum(*gaps) < NEAR * size) & (moved < NEAR * size)
    return len(leaps) if np.sum(back) >= RETURNING * len(back) else 0
