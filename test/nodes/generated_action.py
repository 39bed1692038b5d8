"""Makes a Python package of an action's definition: `python generated_action.py DIRECTORY`.

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
from pathlib import Path

PACKAGE, NAME = "nav2_msgs", "FollowPath"
# fields and codes of Jazzy's, which is all that a type is
DEFINITION = """
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
PREFIX = Path(sys.prefix)
SUPPORTS = "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"
RUNTIME = *SUPPORTS, "rosidl_typesupport_fastrtps_cpp", "rosidl_typesupport_c", "rosidl_runtime_c"
USED = (
    *("nav_msgs", "std_msgs", "action_msgs", "unique_identifier_msgs"),
    *("builtin_interfaces", "service_msgs"),
)
PARTS = *SUPPORTS, "rosidl_typesupport_c", "rosidl_generator_c", "rosidl_generator_py"


def lacking():
    """What is not installed that this takes; empty if all is."""
    headers = Path(sysconfig.get_paths()["include"]) / "Python.h", PREFIX / "include" / "nav_msgs"
    wanted = {"gcc": shutil.which("gcc")} | {str(path): path.exists() for path in headers}
    return ", ".join(name for name, is_there in wanted.items() if not is_there)


def generate(directory):
    """Write the sources of the package into a directory."""
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    file = directory / "source" / "action" / f"{NAME}.action"
    file.parent.mkdir(parents=True)
    file.write_text(DEFINITION)
    generators = {  # the last one's files have names of the others'
        "made": (GenerateC, GenerateFastRTPSCTypesupport, GenerateCTypesupport, GeneratePython),
        "looked_into": (GenerateIntrospectionCTypesupport,),
    }
    for place, kinds in generators.items():
        (directory / place / PACKAGE).mkdir(parents=True)
        for kind in kinds:
            sources = [f"{directory / 'source'}:action/{NAME}.action"]
            include, to = [str(PREFIX / "share")], directory / place / PACKAGE
            kind(kind.__name__).generate(PACKAGE, sources, include, to)


def build(directory):
    """Make the libraries of all sources."""
    made, other = directory / "made", directory / "looked_into"
    package = made / PACKAGE
    fast_dds, introspection = (package / f"lib{PACKAGE}__{name}.so" for name in SUPPORTS)
    compile_into(introspection, other.glob("**/action/**/*.c"), [made, other])
    sources = [
        package / f"_{PACKAGE}_s.ep.rosidl_typesupport_c.c",
        *package.glob("**/action/**/*.c*"),
    ]
    compile_into(fast_dds, [*sources, introspection], [made])
    suffix = sysconfig.get_config_var("EXT_SUFFIX")
    (package / f"{PACKAGE}_s__rosidl_typesupport_c{suffix}").symlink_to(fast_dds.name)
    (package / "__init__.py").touch()


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


def generated(directory):
    """Where the package is found, once it is made."""
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(PREFIX)}
    subprocess.run(
        [sys.executable, __file__, directory],
        check=True,
        env=environment,
        stderr=subprocess.DEVNULL,
    )
    return directory / "made"


if __name__ == "__main__":
    generate(Path(sys.argv[1]))
    build(Path(sys.argv[1]))
