"""A run of a climber, as arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.body_rates import body_rates
from climber_uk.bags.events import Event
from climber_uk.bags.recorded import TimeSeries
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.reference import Reference, tracking_error
from climber_uk.messages import topics
from climber_uk.parameters.parameter_file import Values

REACH = 0.1  # [s] to either side, over which a speed is taken from poses
LEAST = 1e-3  # [m/s, rad/s] that poses have to tell, for zeros to be no rate
# [s] between poses whose straight connections bound a way: noise makes the ones longer than it,
# bends make the others shorter
OFTEN, SELDOM = 0.2, 1.0
MISSING = 3.0  # typical times from one odometry to the next, from which on nobody knows the speed
SLIP_REACH = 0.25  # [s] likewise a speed to the side: slow, and to be told from the poses' noise


@dataclass(frozen=True)
class RecordedRun:
    """What happened from the first odometry that has a reference to the last, or to all odometry.

    Times are stamps, in seconds since the first of these odometry messages.
    """

    name: str  # the climber's namespace
    start: int  # [ns] stamp of time 0
    odometry: (
        TimeSeries  # n messages: x [m], y [m], θ [rad], forwards, to the left [m/s], ω [rad/s]
    )
    reference: Array  # (n, 3) the pose there should have been; nan where there is no reference
    commands: TimeSeries  # torques right, left [N m] that answer these odometry messages
    wheels: tuple[
        TimeSeries, TimeSeries
    ]  # right, left: rates [rad/s] and torques [N m] at the joints
    truth_reference: Array  # (k, 3) as `reference`, at the stamps of the ground truth
    recorded: dict[str, TimeSeries]  # all else, by the topic's name
    events: list[tuple[float, Event]]  # [s] and what was told that is news
    is_diagnosed: bool  # whether its nodes told their states
    parameters: Mapping[str, Any]  # of its controller, by name; none if they are not told
    part: str = ""  # as in "run 1 of 2", where the bag has several of this climber

    @cached_property
    def time(self) -> Array:
        """(n,) [s]."""
        return self.seconds(self.odometry)

    @property
    def pose(self) -> Array:
        """(n, 3) x [m], y [m], θ [rad]."""
        return self.odometry.values[:, :3]

    @cached_property
    def climber(self) -> Climber | None:
        """The climber that the controller's parameters are of, if they are told."""
        return Values(self.parameters).read(Climber) if self.parameters else None

    @cached_property
    def rates(self) -> Array:
        """(n, 3) forwards, to the left [m/s], about z [rad/s]: the twist, else by the poses."""
        twist, by_pose = self.odometry.values[:, 3:], body_rates(self.time, self.pose, REACH)
        is_told = np.isfinite(twist).all(axis=0)
        # zeros of a rate that there is; to the side, drivers may know better than noisy poses
        are_zeros = ~twist.any(axis=0) & (np.abs(by_pose).max(axis=0) > LEAST)
        are_zeros[1] &= are_zeros[0]
        return np.where(is_told & ~are_zeros, twist, by_pose)

    @cached_property
    def travelled(self) -> float:
        """Way of the centre [m]: by the speeds, or by the poses where these contradict them."""
        return self._chords(OFTEN) if self.contradiction else self._way(self.rates[:, 0])

    @cached_property
    def contradiction(self) -> str:
        """What the speeds say of the way, and what the poses say; empty if they may be of one."""
        way = self._way(np.hypot(self.rates[:, 0], self.rates[:, 1]))
        if 0.7 * self._chords(SELDOM) - 0.1 <= way <= 1.3 * self._chords(OFTEN) + 0.05:
            return ""
        return f"its speeds make a way of {way:.4g} m, its poses one of {self._chords(OFTEN):.4g} m"

    def _way(self, speed: Array) -> float:
        """∫ |v| dt [m] of speeds (n,); straight on where odometry is missing."""
        steps = np.diff(self.time)
        way = (abs(speed[1:]) + abs(speed[:-1])) / 2 * steps
        straight = np.hypot(*np.diff(self.pose[:, :2], axis=0).T)
        is_gap = steps > max(OFTEN, MISSING * float(np.median(steps)))
        return float(np.where(is_gap, straight, way).sum())

    def _chords(self, step: float) -> float:
        """Way [m] by straight connections of the poses, one every `step` [s]."""
        marks = [0, *(np.flatnonzero(np.diff(np.floor(self.time / step))) + 1), len(self.time) - 1]
        return float(np.hypot(*np.diff(self.pose[marks, :2], axis=0).T).sum())

    @property
    def side_slip(self) -> Array:
        """(n,) [m/s]."""
        return self.rates[:, 1]

    @cached_property
    def path_rates(self) -> Array:
        """(k, 3) forwards, to the left [m/s], about z [rad/s] by the poses, the true ones if told.

        Wheels cannot tell that they slip, and few drivers give a speed to the left.
        """
        truth = self.recorded[topics.TRUTH]
        seen = truth if len(truth) > 1 else self.odometry
        return body_rates(self.seconds(seen), seen.values[:, :3], SLIP_REACH)

    @cached_property
    def error(self) -> Array:
        """(n, 3) along-track [m], cross-track [m], heading [rad]; nan without a reference."""
        nothing = np.zeros_like(self.reference)
        at = Reference(self.reference, nothing, nothing, nothing[:, :2])
        return np.stack(tracking_error(self.pose, at), axis=-1)

    @cached_property
    def distance(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.hypot(self.error[:, 0], self.error[:, 1])

    @cached_property
    def truth_distance(self) -> Array:
        """Distance of the true place from the reference (k,) [m]."""
        place = self.recorded[topics.TRUTH].values[:, :2]
        return np.hypot(*(place - self.truth_reference[:, :2]).T)

    @property
    def torques(self) -> Array:
        """(m, 2) right, left [N m]."""
        return self.commands.values.reshape(-1, 2)

    @cached_property
    def is_answered(self) -> NDArray[np.bool]:
        """(n,) whether an odometry message has an answer, of which there are m."""
        return np.isin(self.odometry.stamps, self.commands.stamps)

    @property
    def margins(self) -> TimeSeries:
        """(k, 3) slip margin, tip margin, load on the wheels [N]: the plant's, else estimates."""
        told = [self.recorded[name] for name in topics.MARGINS]
        return next((recorded for recorded in told if len(recorded)), told[0])

    @cached_property
    def latency(self) -> Array:
        """(m,) [s] from an odometry's arrival at the recorder to that of its torque."""
        return (self.commands.arrivals - self.odometry.arrivals[self.is_answered]) / SECOND

    @cached_property
    def modes(self) -> list[tuple[Event, float, float]]:
        """Modes of the controller, as far as they are known, with begin and end [s]."""
        told = [(time, event) for time, event in self.events if event.kind == "mode"]
        end = float(self.time[-1])
        times = [min(max(time, 0.0), end) for time, _ in told] + [end]
        return [(event, *span) for (_, event), span in zip(told, pairwise(times), strict=True)]

    def seconds(self, recorded: TimeSeries) -> Array:
        """Times of some messages [s]."""
        return (recorded.stamps - self.start) / SECOND
