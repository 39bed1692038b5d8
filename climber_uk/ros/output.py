"""A topic of a node, published as bytes."""

from collections.abc import Iterable
from typing import Any

from rclpy.publisher import Publisher

from climber_uk.mechanics import SECOND
from climber_uk.messages.in_place import NumberWriter
from climber_uk.messages.reading import STAMP


class Output:
    """Publishes messages that differ in a stamp and a few numbers, while there is a subscription.

    `numbers` are their paths in `message`, which is what all of them have in common.
    """

    def __init__(
        self,
        publisher: Publisher,
        message: Any,
        numbers: Iterable[str],
        stamp: tuple[str, str] = STAMP,
    ) -> None:
        self.publisher = publisher
        self.serialized = NumberWriter(message, (*stamp, *numbers))

    @property
    def is_heard(self) -> bool:
        """Whether there is a subscription."""
        return bool(self.publisher.get_subscription_count())

    def publish(self, stamp: int, *numbers: Any) -> None:
        """Publish numbers of `stamp` [ns], in the order of their paths."""
        if self.is_heard:
            self.publisher.publish(self.serialized(*divmod(stamp, SECOND), *numbers))
