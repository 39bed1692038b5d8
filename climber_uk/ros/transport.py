"""UDP between processes: over shared memory one that is killed can stop the others for seconds.

docs/hardware.md, "Middleware", has the figures, and how to choose something else.
"""

import os
import socket
from collections.abc import MutableMapping
from pathlib import Path

LOCALHOST = Path(__file__).with_name("localhost.xml")
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
# up to Jazzy, which is what the wheels are, and from Kilted on, which warns of the first;
# distributions go by the alphabet
BOTH_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
PROFILES = BOTH_PROFILES[os.environ.get("ROS_DISTRO", "jazzy") > "jazzy"]
# ports of domain 0, of which each domain has 250: one that DDS leaves free, and its first
MARK, FIRST_PARTICIPANT = 7405, 7410
RANGE, ONLY_LOCAL = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"


def use_udp(environment: MutableMapping[str, str] = os.environ) -> None:
    """Have Fast DDS use UDP only, here and in child processes, unless the environment chooses.

    To be called before `rclpy.init`. Within LOCALHOST rmw_fastrtps adds shared memory in any
    case, so there a profile takes the place of that range.
    """
    middleware = environment.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    if environment.keys() & {TRANSPORTS, *BOTH_PROFILES} or "fastrtps" not in middleware:
        return
    environment[TRANSPORTS] = "UDPv4"
    # the older variable goes before the range
    if environment.pop(ONLY_LOCAL, "0") == "1" or environment.get(RANGE) == "LOCALHOST":
        environment.update({RANGE: "SUBNET", PROFILES: str(LOCALHOST)})


def free_domain() -> tuple[int, socket.socket | None]:
    """Return a ROS domain, 1 to 100, that nobody on this computer is in, and what reserves it.

    Without a free one it is any, and not reserved.
    """
    domains = [1 + (os.getpid() + number) % 100 for number in range(100)]
    for domain in domains:
        if mark := reserved(domain):
            return domain, mark
    return domains[0], None


def reserved(domain: int) -> socket.socket | None:
    """Return what reserves a ROS domain while it is open; None if another has it, or is in it."""
    mark = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        mark.bind(("127.0.0.1", MARK + 250 * domain))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("", FIRST_PARTICIPANT + 250 * domain))
    except OSError:
        mark.close()
        return None
    return mark
