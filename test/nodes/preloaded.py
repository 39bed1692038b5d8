"""What the server has done before it forks, so that no node has to: see `forking`.

Beside all imports, these are rclpy's look for each message's type support, and the first look of
its logger for its caller, which goes through the files of all modules.
"""

import ctypes
import importlib
import inspect
import os
import sys

from forking import PROGRAMS

del os.environ["PYTHONPATH"]  # for this import alone
for script in PROGRAMS.values():
    importlib.import_module(f"climber_uk.{script.attr}")
ctypes.CDLL("librmw_fastrtps_cpp.so")
for name in [name for name in sys.modules if name.endswith((".msg", ".srv"))]:
    found = vars(sys.modules[name]).values()
    if kinds := [type(kind) for kind in found if hasattr(kind, "_TYPE_SUPPORT")]:
        ctypes.CDLL(f"lib{name[:-4]}__rosidl_typesupport_fastrtps_c.so")
        for kind in kinds:
            kind.__import_type_support__()
inspect.getframeinfo(inspect.currentframe())
