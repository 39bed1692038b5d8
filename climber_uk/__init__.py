"""Udwadia-Kalaba torque control of a wheeled wall-climbing robot.

In docstrings and comments "(n)" is an equation of Xu & Liu (2017), and "§n" a section: both stand
in docs/theory.md, which has the symbols, too.
"""

import sys

from climber_uk.system.signals import interrupted_in_a_line
from climber_uk.system.streams import open_closed_streams

_program = (sys.argv or [""])[0].rpartition("/")[2]
if _program and "." not in _program and _program[0] != "-":
    # an executable of ours, whose imports take a second: Ctrl-C is a line from the first one on
    open_closed_streams()
    interrupted_in_a_line(_program)
