"""What an operator asks for at random times, and how far off its path a climber is meanwhile."""

import numpy as np
from random_paths import random_path
from scipy.spatial import cKDTree
from test_given_path import MANNER

from climber_uk.control.safety import Mode
from climber_uk.planning.given_path import planned


def some_path(random, place=None):
    """A path that can be driven; it begins near a place (2,) [m]."""
    while True:
        _, places = random_path(random)
        if place is not None:
            places = places - places[0] + place + random.normal(0, 0.2, 2)
        try:
            return planned(places, MANNER)[0]
        except ValueError:
            continue


def moments(climber, random, number, shares):
    """Have an operator ask for `number` things, by the share of each, and tell of each moment.

    Yields what was asked, the number of the first period after it, and how far [s] progress went
    back until the next, but where that was asked for.
    """
    journey = climber.journey
    asked = {
        "pause": climber.pause,
        "go on": climber.go_on,
        "speed": lambda: climber.set_speed(random.uniform(0.2, 1.0)),
        "back": climber.retreat,
        "another path": lambda: climber.replace(some_path(random, climber.places[-1])),
        "start": climber.start,
        "stick": lambda: [
            climber.stick(random.uniform(-0.3, 0.3), random.uniform(-0.5, 0.5))
            for _ in range(random.integers(3, 30))
        ],
    }
    for _ in range(number):
        what = random.choice(list(shares), p=list(shares.values()))
        first, course = len(climber.times), journey.course
        asked[what]()
        climber.run(random.exponential(1.5) + 0.05)
        back = 0.0
        if journey.course is course and journey.hand is None and course.direction > 0:
            back = max(0.0, -np.diff(climber.positions[first:]).min())
        yield what, first, back


def off_line(climber, mode=Mode.FOLLOWING, first=0):
    """Most distance [mm] from the line of where it should have been, in a mode."""
    line = [target[:2] for target in climber.targets if target is not None]
    places = climber.places[first:][np.array(climber.modes[first:]) == mode]
    return 1e3 * float(np.max(cKDTree(line).query(places)[0], initial=0.0))
