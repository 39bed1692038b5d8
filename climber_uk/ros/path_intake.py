"""Paths from outside: read, and planned beside the loop, which goes on meanwhile."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from nav_msgs.msg import Path

from climber_uk.messages.reading_path import path_points
from climber_uk.planning.given_path import Manner, planned
from climber_uk.ros.running import RELIABLE, ClimberNode

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

    from climber_uk.mechanics import Array
    from climber_uk.mechanics.summary import Summary
    from climber_uk.mechanics.trajectory import Trajectory


class Asker(Protocol):
    """Who wants a path driven, and is told what becomes of it."""

    def refused(self, why: str) -> None:
        """Be told that it is not driven."""

    def dropped(self) -> None:
        """Be told that another path came before it was planned."""

    def taken(self, trajectory: "Trajectory") -> None:
        """Be told that it is driven next."""


class PathIntake:
    """Makes trajectories of paths, those of a node's topic among them; the newest counts."""

    def __init__(self, node: ClimberNode, topic: str, manner: Callable[[], Manner]) -> None:
        self._node, self._manner = node, manner
        self._places: Array | None = None  # [m] of the topic's newest path
        self._workers: Executor | None = None
        self._planning: Future[Any] | None = None
        self._asker: Asker = self  # of what is planned
        node.subscription(Path, topic, self.on_path, RELIABLE, raw=True)

    def on_path(self, serialized: bytes) -> None:
        """Plan a path, unless it is the one of before, which planners repeat."""
        try:
            places = path_points(serialized, self._node.names.odom_frame)
        except ValueError as error:
            self.refused(str(error))
            return
        if self._places is not None and np.array_equal(places, self._places):
            return
        self._places = places
        self.plan(places, self)

    def plan(self, places: "Array", asker: Asker) -> None:
        """Plan a path through places (n, 2) [m], for who asks for it."""
        if self._workers is None:
            from concurrent.futures import ThreadPoolExecutor  # only for those who have paths

            self._workers = ThreadPoolExecutor(1)
        if self._planning is not None:
            self.drop()
            self._asker.dropped()
        self._asker, self._planning = asker, self._workers.submit(planned, places, self._manner())

    def drop(self) -> None:
        """Plan no longer what was asked for."""
        if self._planning is not None:
            self._planning.cancel()
        self._planning = None

    def ready(self) -> "tuple[Trajectory, Summary] | None":
        """A path that has been planned since, once."""
        if self._planning is None or not self._planning.done():
            return None
        planning, self._planning = self._planning, None
        try:
            trajectory, summary = planning.result()
        except ValueError as error:
            self._asker.refused(str(error))
            return None
        self._asker.taken(trajectory)
        return trajectory, summary

    def refused(self, why: str) -> None:
        """Report that the topic's path is not driven."""
        self._node.report("path", f"refused: {why}")

    def dropped(self) -> None:
        """Report nothing: the newest counts."""

    def taken(self, _: "Trajectory") -> None:
        """Report that it is."""
        self._node.report("path", "")
