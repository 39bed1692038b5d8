import subprocess
import sys

import pytest

HELD_UP = """
import ctypes
from climber_uk.system.exits import exit_after
print("said before", end="")
exit_after(60.0, STATUS)
exit_after(0.2, STATUS)  # begins to count anew
ctypes.PyDLL(None).pause()  # a library that keeps the interpreter's lock, for ever
"""


@pytest.mark.parametrize("status", [0, 3])
def test_nothing_holds_up_an_exit(status):
    code = HELD_UP.replace("STATUS", str(status))
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (status, "said before", "")
