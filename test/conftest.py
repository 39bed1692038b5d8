"""Shared by all tests: message fields are checked, and rclpy is imported before anything else.

The wheels of rclpy start Python anew to set LD_LIBRARY_PATH; that must come before pytest does
any work. Tests of pure numerics do without it, and run where there is no ROS.
"""

import gc
import os
import signal
from contextlib import suppress

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
if "PYTEST_XDIST_WORKER" not in os.environ:  # they have what `use_udp` has made of it
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
# more would only wait for each other, in each of many processes
os.environ["OPENBLAS_NUM_THREADS"] = "1"

with suppress(ImportError):
    import rclpy  # noqa: F401

    from climber_uk.ros.transport import use_udp

    use_udp()

import pytest
from hypothesis import HealthCheck, settings

# how long an example takes is the machine's matter; each run tries others
settings.register_profile(
    "any machine", deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# under nohup, and in the background of a script, child processes would ignore these, as they should
for number, handler in (
    (signal.SIGHUP, signal.SIG_DFL),
    (signal.SIGINT, signal.default_int_handler),
):
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Without a look for garbage, which takes a third of the time, and never at all this again."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_make_parametrize_id(val):
    """Short names for long texts, which a name would repeat: some are a megabyte."""
    return f"{val[:60]}... {len(val)}" if isinstance(val, str) and len(val) > 100 else None
