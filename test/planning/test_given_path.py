"""Paths from outside are driven within their tolerance, or refused in words."""

import math

import numpy as np
import pytest
from random_paths import ODD, random_path
from under_way import UnderWay

from climber_uk.control.safety import Mode
from climber_uk.mechanics.quantities import State, across
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Rounding
from climber_uk.parameters.parameter_file import Values
from climber_uk.planning.course import PEAK_RATE
from climber_uk.planning.given_path import Manner, planned

RATE, TOLERANCE, LIMIT = 0.2, 0.02, 4.0
MANNER = Manner(Rounding(tolerance=TOLERANCE), RestToRest(rate=RATE, ramp_time=2.0))


def distance(places, line):
    """Distances (n,) of places (n, 2) from a polyline, of whose points 2000 are looked at."""
    line = line[:: max(1, len(line) // 2000)]
    starts, ways = line[:-1], np.diff(line, axis=0)
    square = np.maximum((ways**2).sum(axis=1), 1e-300)
    gaps = places[:, None] - starts
    share = np.clip((gaps * ways).sum(axis=2) / square, 0, 1)
    return np.hypot(*np.moveaxis(gaps - share[..., None] * ways, -1, 0)).min(axis=1)


class Sent(UnderWay):
    """A climber that is sent along one path after the other, each in the midst of the other.

    No torque changes by more than 0.2 N m from one odometry to the next (5 ms).
    """

    def send(self, trajectory):
        self.course.pause(self.position)
        self.run(20, until=lambda: self.course.rests(self.position))
        self.begin(trajectory)

    def drive(self, seconds):
        """Approach the path, and follow it for some time, or to its end."""
        self.run(seconds + 30, until=lambda: self.has_followed(seconds))

    def has_followed(self, seconds):
        if self.modes[-1] is not Mode.FOLLOWING:
            return False
        time, _ = self.course.own_time(self.position)
        return time >= seconds or self.course.is_done(self.position)

    def check(self, first, places):
        """Assert what holds while it follows, since `first`: not on its way there."""
        modes = self.modes[first:]
        assert set(modes) <= {Mode.FOLLOWING, Mode.APPROACHING}
        follows = np.array([mode is Mode.FOLLOWING for mode in modes])
        assert follows.any()
        # where it begins within `max_distance` of the path it comes there in the first seconds
        begun = follows & (np.array(self.positions[first:]) >= 3.5)
        assert distance(self.places[first:][begun][::20], places).max() <= TOLERANCE + 5e-3
        assert np.abs(self.sent[first:]).max() <= LIMIT
        assert np.abs(np.diff(self.sent[max(first - 1, 0) :], axis=0)).max() <= 0.2 + 1e-9
        speeds = np.array([abs(state.forward_speed) for state in self.states[first:]])
        begin = self.course.trajectory.at(0.0).pose[:2]
        is_behind = math.dist(self.places[first], begin) > 5e-3 and Mode.APPROACHING not in modes
        assert speeds[follows].max() <= (catching_up(self) if is_behind else 1.001 * RATE)


def catching_up(climber):
    """Most speed [m/s] of one that begins behind its reference, as docs/control.md has it."""
    law = climber.controller.law.constraints
    return RATE + math.hypot(law.fade_speed / 2, law.catch_up_share * RATE)


def drive_at_random(random, number):
    """Send a climber along `number` paths; return how many were refused."""
    climber, refused = None, []
    for _ in range(number):
        name, places = random_path(random)
        if climber is not None:
            places = places - places[0] + climber.places[-1] + random.normal(0, 0.3, 2)
        try:
            trajectory, _ = planned(places, MANNER)
        except ValueError as error:
            refused.append((name, str(error)))
            continue
        if climber is None:
            climber = Sent(trajectory)
        else:
            climber.send(trajectory)
        first = len(climber.times)
        whole = random.random() < 0.5
        climber.drive(min(trajectory.duration if whole else random.uniform(5, 12), 60))
        climber.check(first, places)
    assert {name for name, _ in refused} <= {"unfit", "noisy"}
    assert all(" m" in said for _, said in refused)
    return len(refused)


def test_random_paths_are_driven_or_refused_in_words():
    drive_at_random(np.random.default_rng(3), 1)


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_a_hundred_random_paths():
    assert drive_at_random(np.random.default_rng(4), 100) > 0


@pytest.mark.parametrize("kind", ODD)
def test_odd_paths_are_planned_within_their_tolerance_and_limits(kind):
    places = kind(np.random.default_rng(1))
    trajectory, _ = planned(places, MANNER)
    reference = trajectory.at(np.linspace(0, trajectory.duration, 2001))
    assert distance(reference.pose[:, :2], places).max() <= TOLERANCE
    assert np.abs(reference.speed).max() <= RATE * (1 + 1e-9)
    assert np.abs(reference.yaw_rate).max() <= MANNER.rounding.max_yaw_rate
    ramp = PEAK_RATE * RATE / MANNER.law.ramp_time
    hardest = np.hypot(*reference.acceleration[:, :2].T).max()
    assert hardest <= 1.15 * MANNER.rounding.max_acceleration + ramp
    assert np.abs(across(reference.heading, reference.velocity)).max() <= 1e-9


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(1, 3))
@pytest.mark.parametrize("kind", ODD)
def test_odd_paths_are_driven(kind, seed):
    places = kind(np.random.default_rng(seed))
    climber = Sent(planned(places, MANNER)[0])
    climber.drive(25)
    climber.check(0, places)


@pytest.mark.parametrize("ramp_time", [0.5, 2.0])
def test_one_that_begins_behind_catches_up_no_faster_than_is_documented(ramp_time):
    line = Trajectory(Line(length=1.0), RestToRest(rate=RATE, ramp_time=ramp_time))
    climber = UnderWay(line, state=State(np.array([-0.099, 0.0, 0.0]), np.zeros(3))).run(2.0)
    most = catching_up(climber)
    assert most == pytest.approx(0.271, abs=5e-4)
    speeds = np.array([state.forward_speed for state in climber.states])
    assert 1.1 * RATE < speeds.max() <= most + 1e-6
    assert set(climber.modes) == {Mode.FOLLOWING}


@pytest.mark.parametrize(
    ("places", "law", "why"),
    [
        (np.zeros((4, 2)), MANNER.law, "path: all points are within 0.00333 m"),
        ([[0, 0], [1, 0]], ConstantRate(0.2), "use 'rest_to_rest'"),
    ],
)
def test_what_cannot_be_driven_is_refused_in_words(places, law, why):
    with pytest.raises(ValueError, match=why):
        planned(np.array(places, float), Manner(MANNER.rounding, law))


def test_a_path_from_outside_is_driven_by_its_own_ramps_where_the_law_is_a_table_of_another():
    given = {"time_law": "fastest", "fastest.file": "x.csv", "rest_to_rest.rate": 0.3}
    manner = Manner.by(Values(given).read, reverse_gear=True)
    assert (manner.law, manner.reverse_gear) == (RestToRest(rate=0.3), True)
    given["time_law"] = "constant_rate"
    assert isinstance(Manner.by(Values(given).read, False).law, ConstantRate)
