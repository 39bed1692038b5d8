"""Shared by all tests: message fields are checked, and rclpy is imported before anything else.

The wheels of rclpy start Python anew to set LD_LIBRARY_PATH; that must come before pytest does
any work. Tests of pure numerics do without it, and run where there is no ROS.
"""

import os
from contextlib import suppress

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# over shared memory, discovery takes seconds longer now and then
os.environ["FASTDDS_BUILTIN_TRANSPORTS"] = "UDPv4"

with suppress(ImportError):
    import rclpy  # noqa: F401
