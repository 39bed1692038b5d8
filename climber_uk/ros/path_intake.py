"""Paths from outside: read, and planned beside the loop, which goes on meanwhile."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

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


class PathIntake:
    """Makes trajectories of the messages of a node's topic; the newest counts."""

    def __init__(self, node: ClimberNode, topic: str, manner: Callable[[], Manner]) -> None:
        self._node, self._manner = node, manner
        self._places: Array | None = None  # [m] of the newest path
        self._workers: Executor | None = None
        self._planning: Future[Any] | None = None
        node.subscription(Path, topic, self.on_path, RELIABLE, raw=True)

    def on_path(self, serialized: bytes) -> None:
        """Plan a path, unless it is the one of before, which planners repeat."""
        try:
            places = path_points(serialized, self._node.names.odom_frame)
        except ValueError as error:
            self._refuse(str(error))
            return
        if self._places is not None and np.array_equal(places, self._places):
            return
        self._places = places
        if self._workers is None:
            from concurrent.futures import ThreadPoolExecutor  # only for those who have paths

            self._workers = ThreadPoolExecutor(1)
        if self._planning is not None:
            self._planning.cancel()
        self._planning = self._workers.submit(planned, places, self._manner())

    def ready(self) -> "tuple[Trajectory, Summary] | None":
        """A path that has been planned since, once."""
        if self._planning is None or not self._planning.done():
            return None
        planning, self._planning = self._planning, None
        try:
            trajectory, summary = planning.result()
        except ValueError as error:
            self._refuse(str(error))
            return None
        self._node.report("path", "")
        return trajectory, summary

    def _refuse(self, why: str) -> None:
        self._node.report("path", f"refused: {why}")
