"""Makes a Python package of a definition: `python generated_interface.py PACKAGE DIRECTORY`.

What colcon does for a package of interfaces, without colcon: code by rosidl's generators, which
come with the wheels of rclpy, and libraries of it by gcc. The module that Python imports is the
library for Fast DDS as well, and brings the one for whoever looks into types as they run: both are
found by their names then, as they are loaded.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from contextlib import contextmanager
from pathlib import Path

import pytest

# fields and codes of Jazzy's, which is all that a type is
FOLLOW_PATH = """
nav_msgs/Path path
string controller_id
string goal_checker_id
string progress_checker_id
---
uint16 NONE=0
uint16 UNKNOWN=100
uint16 INVALID_CONTROLLER=101
uint16 TF_ERROR=102
uint16 INVALID_PATH=103
uint16 PATIENCE_EXCEEDED=104
uint16 FAILED_TO_MAKE_PROGRESS=105
uint16 NO_VALID_CONTROL=106
uint16 CONTROLLER_TIMED_OUT=107
std_msgs/Empty result
uint16 error_code
string error_msg
---
float32 distance_to_goal
float32 speed
"""
DEFINITIONS = {
    "nav2_msgs": ("action", "FollowPath", FOLLOW_PATH),
    "tf2_msgs": ("msg", "TFMessage", "geometry_msgs/TransformStamped[] transforms"),
}
PREFIX = Path(sys.prefix)
SUPPORTS = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
RUNTIME = *SUPPORTS, "rosidl_typesupport_fastrtps_cpp", "rosidl_typesupport_c", "rosidl_runtime_c"
USED = (
    *("nav_msgs", "std_msgs", "action_msgs", "unique_identifier_msgs"),
    *("builtin_interfaces", "service_msgs", "geometry_msgs"),
)
PARTS = *SUPPORTS, "rosidl_typesupport_c", "rosidl_generator_c", "rosidl_generator_py"


def lacking():
    """What is not installed that this takes; empty if all is."""
    headers = Path(sysconfig.get_paths()["include"]) / "Python.h", PREFIX / "include" / "nav_msgs"
    wanted = {"gcc": shutil.which("gcc")} | {str(path): path.exists() for path in headers}
    return ", ".join(name for name, is_there in wanted.items() if not is_there)


def generate(package, directory):
    """Write the sources of a package into a directory."""
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    kind, name, definition = DEFINITIONS[package]
    file = directory / "source" / kind / f"{name}.{kind}"
    file.parent.mkdir(parents=True)
    file.write_text(definition)
    generators = {  # the last one's files have names of the others'
        "made": (GenerateC, GenerateFastRTPSCTypesupport, GenerateCTypesupport, GeneratePython),
        "looked_into": (GenerateIntrospectionCTypesupport,),
    }
    for place, kinds in generators.items():
        (directory / place / package).mkdir(parents=True)
        for maker in kinds:
            sources = [f"{directory / 'source'}:{kind}/{name}.{kind}"]
            include, to = [str(PREFIX / "share")], directory / place / package
            maker(maker.__name__).generate(package, sources, include, to)


def build(package, directory):
    """Make the libraries of all sources."""
    made, other = directory / "made", directory / "looked_into"
    place, (kind, *_) = made / package, DEFINITIONS[package]
    fast_dds, introspection = (place / f"lib{package}__{name}.so" for name in SUPPORTS)
    compile_into(introspection, other.glob(f"**/{kind}/**/*.c"), [made, other])
    sources = [
        place / f"_{package}_s.ep.rosidl_typesupport_c.c",
        *place.glob(f"**/{kind}/**/*.c*"),
    ]
    compile_into(fast_dds, [*sources, introspection], [made])
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    (place / f"{package}_s__rosidl_typesupport_c{suffix}").symlink_to(fast_dds.name)
    (place / "__init__.py").touch()


def compile_into(library, sources, headers):
    """Make a library that finds the others of rclpy, and those beside it."""
    import numpy

    found = [f"{name}__{part}" for name in USED for part in PARTS]
    libraries = [name for name in [*found, *RUNTIME] if (PREFIX / "lib" / f"lib{name}.so").exists()]
    headers = [*headers, PREFIX / "include", *(PREFIX / "include").iterdir(), numpy.get_include()]
    headers.append(sysconfig.get_paths()["include"])
    subprocess.run(
        [
            *("gcc", "-O0", "-w", "-shared", "-fPIC", f"-Wl,-soname,{library.name}"),
            *("-o", library, "-Wl,--no-as-needed", *sources),
            *(f"-I{header}" for header in headers),
            *(f"-L{PREFIX / 'lib'}", f"-Wl,-rpath,{PREFIX / 'lib'}:{library.parent}"),
            *(f"-l{name}" for name in [*libraries, "fastcdr", "rmw", "stdc++"]),
        ],
        check=True,
    )


def generated(package, directory):
    """Where a package is found, once it is made."""
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(PREFIX)}
    subprocess.run(
        [sys.executable, __file__, package, directory],
        check=True,
        env=environment,
        stderr=subprocess.DEVNULL,
    )
    return directory / "made"


@contextmanager
def importable(package, directory):
    """Have a package found, here and in processes that are started: made where there is none."""
    with pytest.MonkeyPatch.context() as patch:
        if missing := lacking():
            pytest.skip(f"{package} cannot be made without {missing}")
        made = generated(package, directory)
        patch.setenv("PYTHONPATH", str(made))
        patch.syspath_prepend(made)
        yield
    for name in [name for name in sys.modules if name.startswith(package)]:
        del sys.modules[name]


if __name__ == "__main__":
    generate(sys.argv[1], Path(sys.argv[2]))
    build(sys.argv[1], Path(sys.argv[2]))
