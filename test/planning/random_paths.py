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


def inwards(random):
    """A spiral that ends in its middle."""
    angle = np.linspace(0, random.uniform(6, 14), 200)
    return np.linspace(0.5, 0.0, 200)[:, None] * np.c_[np.cos(angle), np.sin(angle)]


def zigzag(random):
    """By short and long legs in turns."""
    odd = np.arange(20) % 2
    steps = np.where(odd, random.uniform(0.005, 0.05), random.uniform(0.05, 0.3))
    return np.c_[np.cumsum(steps), odd * random.uniform(0.01, 0.2)]


def touching(random):
    """A circle, one that touches it, and the first again."""
    angle = np.linspace(0, 2 * np.pi, 40)
    circle = random.uniform(0.15, 0.3) * np.c_[np.cos(angle) - 1, np.sin(angle)]
    return np.concatenate([circle, -circle, circle])


def beside(random):
    """Out and back, each way so little beside the one before."""
    offset, there = random.choice([1e-4, 1e-3, 4e-3, 0.01, 0.02, 0.04]), [0, 0.4, 0.4, 0]
    return np.c_[np.tile(there, 2), offset * np.repeat(np.arange(4), 2)]


def tiny(random):
    """Some millimetres of it."""
    return np.cumsum(random.uniform(-1, 1, (4, 2)), axis=0) * random.uniform(5e-3, 2e-2)


def long(random):
    """Straight, to as far as a place may be."""
    angle = random.uniform(0, 2 * np.pi)
    return np.linspace(0, 9e5, 30)[:, None] * [np.cos(angle), np.sin(angle)]


def repeated(random):
    """Each of its places some thousand times."""
    return np.repeat(random.uniform(-0.4, 0.4, (4, 2)), random.integers(3000, 12_000, 4), axis=0)


def exactly_back(random):
    """There and back along one line, by 180 degrees to the last bit."""
    return random.uniform(-0.5, 0.5, (6, 1)) * [3 / 5, 4 / 5]


def nearly_back(random):
    """Corners just more and just less sharp than those that are driven in reverse."""
    corners = np.pi - 0.35 + random.choice([-0.1, -1e-6, 1e-6, 0.1], 4)
    angle = np.cumsum(np.append(0, corners * random.choice([-1, 1], 4)))
    legs = random.uniform(0.1, 0.4, 5)
    return np.cumsum(legs[:, None] * np.c_[np.cos(angle), np.sin(angle)], axis=0)


def nearly_closed(random):
    """Its end about a sixth of the tolerance from its beginning."""
    places = random.uniform(-0.4, 0.4, (4, 2))
    return np.concatenate([places, places[:1] + random.normal(0, 3e-3, 2)])


def cells(random):
    """From one cell of a grid to a next one, straight or diagonally."""
    steps = np.array([[1, 0], [1, 1], [0, 1], [1, -1]])[random.integers(0, 4, 30)]
    return random.choice([0.005, 0.01, 0.03, 0.05]) * np.cumsum(steps, axis=0)


def loops(random):
    """Of about the tolerance's size, and larger."""
    angle = np.linspace(0, 4 * np.pi, 80)
    circles = np.c_[np.cos(3 * angle), np.sin(3 * angle)]
    return random.choice([0.004, 0.015, 0.06]) * circles + np.c_[0.05 * angle, 0 * angle]


def outlier(random):
    along = np.linspace(0, 1, 40)
    places = np.c_[along, 0.05 * np.sin(6 * along)]
    places[random.integers(1, 39)] += random.uniform(-0.6, 0.6, 2)
    return places


def graded(random):
    """From steps of half a metre to those of a tenth of a micrometre."""
    angle = np.cumsum(random.normal(0, 0.3, 40))
    steps = np.geomspace(0.5, 1e-7, 40)
    return np.cumsum(steps[:, None] * np.c_[np.cos(angle), np.sin(angle)], axis=0)


def far(random):
    """About as far from the origin as a place may be."""
    return random.uniform(-0.4, 0.4, (4, 2)) + 9.9e5


def star(random):
    angle, radius = np.linspace(0, 2 * np.pi, 15), np.tile([0.3, 0.02], 8)[:15]
    return radius[:, None] * np.c_[np.cos(angle), np.sin(angle)] + random.normal(0, 1e-3, 2)


def hooks(random):
    """Ends that turn off within millimetres."""
    end, places = random.uniform(-8e-3, 8e-3, 2), random.uniform(-0.3, 0.3, (3, 2))
    return np.concatenate([places[:1] - end, places, places[-1:] + end])


def standing(random):
    """Poses as they were recorded of something that stood for a while."""
    along, stood = np.linspace(0, 0.4, 40), random.normal(0, 5e-4, (300, 2))
    way = [np.c_[along - 0.4, 0 * along], stood, np.c_[along, 0.5 * along]]
    return np.concatenate(way)


ODD = [
    *(inwards, zigzag, touching, beside, tiny, long, repeated, exactly_back, nearly_back),
    *(nearly_closed, cells, loops, outlier, graded, far, star, hooks, standing),
]
