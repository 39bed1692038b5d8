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
from climber_uk.bags.time_series import TimeSeries
from climber_uk.mechanics import SECOND, Array, Stamps
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.reference import Reference, tracking_error
from climber_uk.messages import topics
from climber_uk.parameters.parameter_file import Values

REACH = 0.1  # [s] to either side, over which a speed by poses is the mean
LEAST = 1e-3  # [m/s, rad/s] by poses, above which zeros in the twist are no measurement
# [s] between poses whose straight connections bound the distance travelled: noise makes the first
# sum too long, bends make the other one too short
OFTEN, SELDOM = 0.2, 1.0
# correlation of twist and poses' rates, and metres or radians of way, from which on a ratio of them
# counts, and the highest that is taken for noise or slip
ALIKE, LEAST_WAY, MOST_RATIO = 0.9, 0.1, 1.4
FITS = 0.05  # times the squares of misfits of another explanation: it is the right one
MISSING = 3.0  # typical times from one odometry to the next, above which the speed is unknown
SLIP_REACH = 0.25  # [s] as `REACH`, for the speed to the side: slow, and hidden by noise of poses


@dataclass(frozen=True)
class RecordedRun:
    """A run from the first to the last odometry message that has a reference; without one, all.

    Times are stamps, in seconds since the first of these messages. Poses are in the wall's frame.
    """

    name: str  # the climber's namespace
    start: int  # [ns] stamp of time 0
    # n messages: x [m], y [m], θ [rad], forwards, to the left [m/s], ω [rad/s]
    odometry: TimeSeries
    reference: Array  # (n, 3) pose of the reference then; nan where there is none
    commands: TimeSeries  # torques right, left [N m] that answer these odometry messages
    unanswerable: Stamps  # [ns] of torques that answer no odometry of the bag
    # right, left: rates [rad/s] and torques [N m] at the joints
    wheels: tuple[TimeSeries, TimeSeries]
    truth_reference: Array  # (k, 3) as `reference`, at the stamps of the ground truth
    recorded: dict[str, TimeSeries]  # of the other topics, by their names
    events: list[tuple[float, Event]]  # [s] and each change, see `events.changes`
    is_diagnosed: bool  # whether there are diagnostics of its nodes
    parameters: Mapping[str, Any]  # of its controller, by name; empty if they are unknown
    part: str = ""  # as in "run 1 of 2", where the bag has several of this climber

    @cached_property
    def time(self) -> Array:
        """Stamps of the odometry (n,) [s]."""
        return self.seconds(self.odometry)

    @property
    def pose(self) -> Array:
        """Poses of the odometry (n, 3): x [m], y [m], θ [rad]."""
        return self.odometry.values[:, :3]

    @cached_property
    def climber(self) -> Climber | None:
        """The climber as the controller's parameters have it; None if they are unknown."""
        return Values(self.parameters).read(Climber) if self.parameters else None

    @cached_property
    def rates(self) -> Array:
        """Speeds (n, 3) forwards, to the left [m/s], about z [rad/s]: the twist, else by poses."""
        twist, by_pose = self.odometry.values[:, 3:], body_rates(self.time, self.pose, REACH)
        is_known = np.asarray(np.isfinite(twist).all(axis=0))
        is_known[:2] &= not self.is_twist_of_the_wall
        # zeros though it moves; to the side, the driver's zero may be truer than noisy poses
        are_zeros = ~twist.any(axis=0) & (np.abs(by_pose).max(axis=0) > LEAST)
        are_zeros[1] &= are_zeros[0]
        return np.where(is_known & ~are_zeros, twist, by_pose)

    @cached_property
    def travelled(self) -> float:
        """Distance travelled by the centre [m]: ∫ |v| dt, or by poses where these contradict it."""
        return self._chords(OFTEN) if self.contradiction else self._integral(self.rates[:, 0])

    @cached_property
    def is_twist_of_the_wall(self) -> bool:
        """Whether the twist's x and y are along the wall's axes, not the climber's."""
        by_pose, twist = (
            body_rates(self.time, self.pose, REACH)[:, :2],
            self.odometry.values[:, 3:5],
        )
        way, heading = self.time[-1] * np.abs(by_pose[:, 0]).mean(), self.pose[:, 2]
        cosine, sine = np.cos(heading), np.sin(heading)
        turned = np.stack([by_pose[:, 0] * cosine, by_pose[:, 0] * sine], axis=1)
        of_body, of_wall = (np.nansum((twist - it) ** 2) for it in (by_pose, turned))
        return bool(way > LEAST_WAY and of_wall < FITS * of_body)

    @cached_property
    def contradiction(self) -> str:
        """The distance by speeds and that by poses, in words; empty if they may be the same."""
        distance = self._integral(np.hypot(self.rates[:, 0], self.rates[:, 1]))
        by_poses = self._chords(OFTEN)
        if 0.7 * self._chords(SELDOM) - 0.1 <= distance <= 1.3 * by_poses + 0.05:
            return ""
        return f"its speeds make a way of {distance:.4g} m, its poses one of {by_poses:.4g} m"

    @cached_property
    def wrong_twist(self) -> list[str]:
        """What a twist has that is a multiple of its poses' rates, or not finite, in words."""
        found, by_pose = [], body_rates(self.time, self.pose, REACH)
        if self.is_twist_of_the_wall:
            return ["linear.x and linear.y are along the wall's axes, not the climber's"]
        for name, column, turn in (("linear.x", 3, 0), ("angular.z", 5, 2)):
            twist, rate = self.odometry.values[:, column], by_pose[:, turn]
            is_known = np.isfinite(twist)
            if 0 < (count := np.count_nonzero(~is_known)) < len(twist):
                found.append(f"{name} is not finite in {count} of {len(twist)} messages")
            twist, rate = twist[is_known], rate[is_known]
            product, sizes = float(twist @ rate), float(np.sqrt(twist @ twist * (rate @ rate)))
            if abs(product) <= ALIKE * sizes or abs(rate).mean() * self.time[-1] < LEAST_WAY:
                continue  # noise, or too little to tell
            ratio = product / float(rate @ rate)
            is_said = name == "linear.x" and self.contradiction
            if not (is_said or 1 / MOST_RATIO < ratio < MOST_RATIO):
                found.append(f"{name} is {ratio:.3g} times the rate of its poses")
        return found

    def _integral(self, speed: Array) -> float:
        """∫ |v| dt [m] of speeds (n,); straight on where odometry is missing."""
        steps = np.diff(self.time)
        integrated = (abs(speed[1:]) + abs(speed[:-1])) / 2 * steps
        straight = np.hypot(*np.diff(self.pose[:, :2], axis=0).T)
        is_gap = steps > max(OFTEN, MISSING * float(np.median(steps)))
        return float(np.where(is_gap, straight, integrated).sum())

    def _chords(self, step: float) -> float:
        """Length [m] of straight connections of poses, one every `step` [s]."""
        marks = [0, *(np.flatnonzero(np.diff(np.floor(self.time / step))) + 1), len(self.time) - 1]
        return float(np.hypot(*np.diff(self.pose[marks, :2], axis=0).T).sum())

    @property
    def side_slip(self) -> Array:
        """Speed to the left (n,) [m/s], by `rates`."""
        return self.rates[:, 1]

    @cached_property
    def path_rates(self) -> Array:
        """Speeds (k, 3) forwards, to the left [m/s], about z [rad/s], by poses alone.

        Of the ground truth, if it was recorded. Odometry of wheels does not see their slip, and few
        drivers publish a speed to the left.
        """
        truth = self.recorded[topics.TRUTH]
        poses = truth if len(truth) > 1 else self.odometry
        return body_rates(self.seconds(poses), poses.values[:, :3], SLIP_REACH)

    @cached_property
    def error(self) -> Array:
        """Tracking errors (n, 3): along-track [m], cross-track [m], heading [rad].

        nan without a reference.
        """
        nothing = np.zeros_like(self.reference)
        at = Reference(self.reference, nothing, nothing, nothing[:, :2])
        return np.stack(tracking_error(self.pose, at), axis=-1)

    @cached_property
    def distance(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.hypot(self.error[:, 0], self.error[:, 1])

    @cached_property
    def truth_distance(self) -> Array:
        """Distance of the true position from the reference (k,) [m]."""
        place = self.recorded[topics.TRUTH].values[:, :2]
        return np.hypot(*(place - self.truth_reference[:, :2]).T)

    @property
    def torques(self) -> Array:
        """Torques (m, 2) right, left [N m] that were commanded."""
        return self.commands.values.reshape(-1, 2)

    @cached_property
    def is_answered(self) -> NDArray[np.bool]:
        """Whether each odometry message (n,) was answered by torques, as m of them were."""
        return np.isin(self.odometry.stamps, self.commands.stamps)

    @property
    def margins(self) -> TimeSeries:
        """Slip margin, tip margin, load on the wheels [N] (k, 3): the plant's, else estimates."""
        plants, estimates = (self.recorded[name] for name in topics.MARGINS)
        return plants if len(plants) else estimates

    @cached_property
    def latency(self) -> Array:
        """Time (m,) [s] from an odometry's arrival at the recorder to that of its torque."""
        return (self.commands.arrivals - self.odometry.arrivals[self.is_answered]) / SECOND

    @cached_property
    def modes(self) -> list[tuple[Event, float, float]]:
        """Modes of the controller, as far as they are known, with begin and end [s]."""
        modes = [(time, event) for time, event in self.events if event.kind == "mode"]
        end = float(self.time[-1])
        times = [min(max(time, 0.0), end) for time, _ in modes] + [end]
        return [(event, *span) for (_, event), span in zip(modes, pairwise(times), strict=True)]

    def seconds(self, recorded: TimeSeries) -> Array:
        """Times of some messages [s]."""
        return (recorded.stamps - self.start) / SECOND
