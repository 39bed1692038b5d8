"""UDP between processes: over shared memory one that is killed can stop the others for seconds.

docs/hardware.md, "Middleware", has the figures, and how to choose something else.
"""

import os
import socket
from collections.abc import MutableMapping
from pathlib import Path

LOCALHOST = Path(__file__).with_name("localhost.xml")
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
# up to Jazzy, which is what the wheels are, and from Kilted on; distributions go by the alphabet
BOTH_PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"
PROFILES = BOTH_PROFILES[os.environ.get("ROS_DISTRO", "jazzy") > "jazzy"]
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


def free_domain() -> int:
    """Return a ROS domain, 1 to 100, that nobody on this computer seems to be in."""
    domains = [1 + (os.getpid() + number) % 100 for number in range(100)]
    return next(filter(is_free, domains), domains[0])


def is_free(domain: int) -> bool:
    """Whether nobody on this computer has the port of a domain's first participant."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", 7410 + 250 * domain))
        except OSError:
            return False
    return True
