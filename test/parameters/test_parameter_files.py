"""Parameter files mean the same to the tools as to rcl, which reads them for the nodes."""

import math
import random
import resource
import signal

import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node

from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.parameter_file import Values, read_argument, read_file
from climber_uk.parameters.text_file import write_whole
from climber_uk.ros.parameters import NodeParameters

SCALARS = """\
5 5. 5.0 .5 -.5 +5 5e0 8e3 33e-2 1E5 1e+5 -1e-5 5.e3 08 010 -010 0x1F 0x1p3 0o17 0b1 1_000 1:30 00
0 -0 +0 9223372036854775807 9223372036854775808 1e999 y Y n N yes no on off Yes NO On OFF true True
TRUE tRUE null ~ .inf -.inf +.inf .nan .NaN inf -inf nan NaN Infinity 1.2.3 1e 1e5e5 e5 . a 12h
2026-01-02 '5e0' "n" ٥ 5٥ 1e٥
"""


def read_by_rcl(path):
    """What a node's parameters are after rcl has read the file."""
    context = Context()
    rclpy.init(args=["--ros-args", "--params-file", str(path)], context=context)
    node = Node("x", context=context, start_parameter_services=False, enable_rosout=False)
    try:
        return {name: given.value for name, given in node._parameter_overrides.items()}
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@parameters
class Renamed:
    """A parameter that was called `size`."""

    length: float = parameter(1.0, "m", "length", formerly="size")


@pytest.mark.parametrize(("given", "length"), [(["size:=2"], 2.0), (["size:=2", "length:=3"], 3.0)])
def test_a_parameter_is_taken_under_its_former_name_with_a_remark(given, length):
    arguments = ["--ros-args", *(word for one in given for word in ("-p", f"part.{one}"))]
    context = Context()
    rclpy.init(args=arguments, context=context)
    node = Node("x", context=context, start_parameter_services=False, enable_rosout=False)
    parameters = NodeParameters(node, arguments)
    parameters.declare(Renamed, "part.")
    parameters.refuse_unknown()
    assert parameters.read(Renamed, "part.") == Renamed(length)
    assert parameters.remarks == ["part.size is called part.length now"]
    values = dict(read_argument(f"part.{one}") for one in given)
    assert Values(values).read(Renamed, "part.") == Renamed(length)
    node.destroy_node()
    rclpy.shutdown(context=context)


@parameters
class Sized:
    """A parameter."""

    length: float = parameter(1.0, "m", "length")


def started(namespace, *arguments):
    """Length, and remarks, of a node x in a namespace; raises `ValueError` if it does not start."""
    arguments = ["--ros-args", *map(str, arguments)]
    context = Context()
    rclpy.init(args=arguments, context=context)
    how = {"start_parameter_services": False, "enable_rosout": False}
    node = Node("x", context=context, namespace=namespace, **how)
    try:
        parameters = NodeParameters(node, arguments)
        parameters.declare(Sized)
        parameters.refuse_unknown()
        return parameters.read(Sized).length, parameters.remarks
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


SHARED = ["given to all nodes, but no parameter of this one: width"]


@pytest.mark.parametrize(
    ("namespace", "name", "is_shared"),
    [
        *(("", name, False) for name in ("x", "/x", "/**/x")),
        *(("/a", name, False) for name in ("/a/x", "a/x", "/**/x", "/*/x", "/**/a/x")),
        *(("/a/b", name, False) for name in ("/a/b/x", "/*/b/x", "/a/**/x", "/**/x")),
        *(("", name, True) for name in ("/**", "/*")),
        *(("/a", name, True) for name in ("/**", "/a/*", "/a/**", "/*/*", "/*/**", "/**/*")),
    ],
)
def test_a_parameter_that_a_node_has_not_is_refused_by_its_name_and_remarked_if_all_are_meant(
    tmp_path, namespace, name, is_shared
):
    file = tmp_path / "x.yaml"
    file.write_text(f"{name}:\n  ros__parameters: {{length: 2, width: 3.0}}\n")
    full = f"{namespace}/x"
    assert read_file(file, full) == {"length": 2, "width": 3.0}
    if is_shared:
        assert started(namespace, "--params-file", file) == (2.0, SHARED)
    else:
        with pytest.raises(ValueError, match=r"^width is not a parameter of x$"):
            started(namespace, "--params-file", file)


@pytest.mark.parametrize("order", [1, -1])
def test_one_that_is_given_by_name_as_well_is_refused(tmp_path, order):
    file = tmp_path / "x.yaml"
    sections = [f"{name}:\n  ros__parameters: {{width: 3.0}}\n" for name in ("/**", "/**/x")]
    file.write_text("".join(sections[::order]))
    with pytest.raises(ValueError, match=r"^width is not a parameter of x$"):
        started("", "--params-file", file)
    with pytest.raises(ValueError, match=r"^width is not a parameter of x$"):
        started("", "-p", "width:=3.0")


def same(one, other):
    return type(one) is type(other) and (
        one == other or (isinstance(one, float) and math.isnan(one) and math.isnan(other))
    )


def wrong(texts, directory):
    """Scalars that we read otherwise than rcl, with both values."""
    path = directory / "x.yaml"
    lines = [f"    p{number}: {text}\n" for number, text in enumerate(texts)]
    path.write_text("x:\n  ros__parameters:\n" + "".join(lines))
    ours, theirs = read_file(path, "/x"), read_by_rcl(path)
    assert ours.keys() == theirs.keys()
    both = {text: (ours[f"p{i}"], theirs[f"p{i}"]) for i, text in enumerate(texts)}
    return {text: values for text, values in both.items() if not same(*values)}


def test_scalars_are_what_rcl_takes_them_for(tmp_path):
    assert not wrong([*SCALARS.split(), "!!str 5", "|\n      5"], tmp_path)


def test_any_scalar_is_what_rcl_takes_it_for(tmp_path):
    draw = random.Random(1)
    first, later = ".0123456789xnyif+", "-+.0123456789aeExXinfyo_"
    texts = {
        draw.choice(first) + "".join(draw.choices(later, k=draw.randrange(7))) for _ in range(5000)
    }
    assert not wrong(sorted(texts), tmp_path)


def test_a_list_has_an_end_and_so_has_what_is_said_of_it(tmp_path):
    @parameters
    class Load:
        mass: float = parameter(1.0, "kg", "mass", above=0)

    for count, said in ((10_001, "line 3: mass has more than 10000 values"), (999, "finite")):
        file = tmp_path / "long.yaml"
        file.write_text(f"x:\n  ros__parameters:\n    mass: [{', '.join(['5.0'] * count)}]\n")
        with pytest.raises(ValueError, match=said) as refused:
            Values(read_file(file, "/x")).read(Load)
        assert len(str(refused.value)) < 300


def test_a_file_is_written_wholly_or_stays_what_it_was(tmp_path):
    file = tmp_path / "mine.yaml"
    (tmp_path / "link.yaml").symlink_to(file)
    write_whole(tmp_path / "link.yaml", "before")
    assert file.read_text() == "before"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OSError, match=r"cannot write .*mine.yaml \(File too large\)"):
            write_whole(file, 9999 * "x")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert file.read_text() == "before"
    assert {path.name for path in tmp_path.iterdir()} == {"mine.yaml", "link.yaml"}
