"""The C in climber.c, built with gcc and called through cffi (bench/requirements.txt)."""

import re
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.control.control_law import ControlLaw
from climber_uk.control.guidance import HEADING_SHARE, Guidance
from climber_uk.control.model import Observer
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

SOURCE = Path(__file__).parent / "climber.c"
FLAGS = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]


class Limit:
    """The library, and its arguments."""

    def __init__(self) -> None:
        from cffi import FFI

        self.ffi, source = FFI(), SOURCE.read_text()
        types = re.findall(r"^typedef struct \{[^}]*\} \w+;", source, re.MULTILINE)
        functions = re.findall(r"^(void [^{]*?) \{", source, re.MULTILINE)
        self.ffi.cdef("\n".join([*types, *(f"{function};" for function in functions)]))
        with tempfile.TemporaryDirectory() as directory:
            library = f"{directory}/climber.so"
            subprocess.run(["gcc", *FLAGS, "-o", library, SOURCE, "-lm"], check=True)
            self.functions: Any = self.ffi.dlopen(library)

    def pointer(self, kind: str, numbers: Array) -> Any:
        """Contiguous numbers as structs of a kind."""
        return self.ffi.from_buffer(f"{kind}[]", numbers)


def climber_numbers(climber: Climber, number: int) -> Array:
    """Numbers (7, number) of a `Climber` in C, or of many."""
    numbers = (
        *(climber.mass, climber.yaw_inertia, climber.wheel_radius, climber.half_track),
        *(climber.seal_friction, climber.weight_along_wall, climber.max_wheel_torque),
    )
    return np.array([np.broadcast_to(each, number) for each in numbers], float)


def law_numbers(law: ControlLaw, observer: Observer) -> Array:
    """Numbers (18,) of a `Law` in C."""
    gains = law.constraints
    assert isinstance(gains, Guidance)
    numbers = (
        *(gains.frequency, 2 * gains.damping, HEADING_SHARE * gains.frequency),
        *(gains.cross_track_gain, gains.fade_speed, gains.catch_up_share, gains.catch_up_speed),
        *(gains.turn_radius, gains.turn_rate, law.options.friction_speed, observer.bandwidth),
    )
    return np.concatenate([climber_numbers(law.climber, 1)[:, 0], numbers])
