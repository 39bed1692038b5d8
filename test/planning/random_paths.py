"""Paths as planners, coverage tools and people's clicks give them."""

import numpy as np


def random_path(random):
    """A name, and places (n, 2) [m]."""
    kinds = [walk, corners, duplicates, cusps, dense, two, crossing, spiral, noisy, unfit]
    kind = kinds[random.integers(len(kinds))]
    return kind.__name__, np.asarray(kind(random), float)


def walk(random):
    turns = np.cumsum(random.normal(0, 0.15, 80))
    return np.cumsum(0.03 * np.c_[np.cos(turns), np.sin(turns)], axis=0)


def corners(random):
    return random.uniform(-0.6, 0.6, (random.integers(3, 6), 2))


def duplicates(random):
    return np.repeat(corners(random), random.integers(1, 4), axis=0)


def cusps(random):
    """Out and back, again and again, as Reeds and Shepp's shortest paths go."""
    way = np.cumsum(random.uniform(0.2, 0.5, 4) * [1, -1, 1, -1])
    return np.c_[way, 0.02 * random.normal(size=4)]


def dense(random):
    """Thousands of poses a few micrometres apart."""
    angle = np.linspace(0, random.uniform(1, 5), 50_000)
    return random.uniform(0.3, 0.6) * np.c_[np.cos(angle), np.sin(angle)]


def two(random):
    return random.uniform(-1, 1, (2, 2))


def crossing(random):
    return 0.6 * np.c_[np.cos(t := np.arange(6) * 0.8 * np.pi), np.sin(t)]


def spiral(random):
    angle = np.linspace(0.5, 9, 60)
    return 0.07 * angle[:, None] * np.c_[np.cos(angle), np.sin(angle)]


def noisy(random):
    """Clicks or cells, a few millimetres off, closer than the tolerance."""
    along = np.linspace(0, 1.2, 200)
    return np.c_[along, 0.1 * np.sin(5 * along)] + random.normal(0, 2e-3, (200, 2))


def unfit(random):
    """All in one place."""
    return np.zeros((5, 2)) + random.normal(0, 1e-4, (5, 2))
