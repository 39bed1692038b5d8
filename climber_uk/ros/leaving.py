"""The last that a process with nodes does."""

import rclpy
from rclpy.node import Node

from climber_uk.system.exits import exit_after
from climber_uk.system.signals import ignore_end

LONGEST_END = 4  # [s] for each step of a process's end, whatever hangs


def leave(status: int, *nodes: Node | None) -> None:
    """Take nodes out of their domain, before this process ends with `status`, whatever happens.

    Fast DDS 2.14 waits for ever, now and then, where a participant ends as its neighbours do
    (`DomainParticipant::set_listener` waits for a callback, and that for it), and Python with it.
    So all else has to be done before, and printed.
    """
    ignore_end()  # the terminal and launch may both send a signal
    for node in filter(None, nodes):
        exit_after(LONGEST_END, status)  # a slow machine has that time for each
        node.destroy_node()
    exit_after(LONGEST_END, status)
    rclpy.try_shutdown()
    exit_after(LONGEST_END, status)  # the interpreter's end takes away what is left
