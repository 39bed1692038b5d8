"""UDP between processes: over shared memory one that is killed can stop the others for seconds.

docs/hardware.md, "Middleware", has the figures, and how to choose something else.
"""

import os
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
