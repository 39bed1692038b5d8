"""Nodes start, refuse to start with one clear line, and end without a trace."""

import signal

import pytest
from forking import Forked
from world import CONFIG, TIMEOUT, installation

pytestmark = pytest.mark.nodes

QOS = "qos_overrides./odom.subscription"
NODES = ["trajectory_publisher", "uk_torque_controller", "plant_simulator"]


@pytest.mark.parametrize(
    ("name", "parameters", "line"),
    [
        ("trajectory_publisher", ["shape:=heart"], "shape='heart' must be one of ellipse, circle"),
        ("trajectory_publisher", ["time_law:=constant_rate", "shape:=line"], "'rest_to_rest'"),
        ("trajectory_publisher", ["preview:=0.1"], r"preview=0.1 must be >= 2 publish_period"),
        ("uk_torque_controller", ["mass:=-5.0"], "mass=-5.0 must be > 0 [kg]"),
        ("uk_torque_controller", ["guidance.frequency:=0.0"], "guidance.frequency=0.0 must be"),
        ("uk_torque_controller", ["mass:=five"], "mass='five' must be a finite number [kg]"),
        (
            "uk_torque_controller",
            ["mass:=9007199254740993"],
            "mass=9007199254740993 must be of a size",
        ),
        (
            "uk_torque_controller",
            ["settling_messages:=5.0"],
            "settling_messages=5.0 must be an integer",
        ),
        (
            "uk_torque_controller",
            ["use_sim_time:=1"],
            "'use_sim_time' to '1' of type 'INTEGER', exp",
        ),
        ("uk_torque_controller", ["mass:=[]"], "mass has no value"),
        ("uk_torque_controller", ["ma\x1b[31ms:=5.0"], r"ma\x1b[31ms"),
        ("uk_torque_controller", ["maas:=5.0"], "maas is not a parameter"),
        ("uk_torque_controller", ["half_trak:=0.3"], "(did you mean half_track?)"),
        ("uk_torque_controller", ["guidance.turnrate:=3.0"], "(did you mean guidance.turn_rate?)"),
        (
            "uk_torque_controller",
            [f"{QOS}.reliability:=relaible"],
            "qos_overrides of odom: Unexpected",
        ),
        ("uk_torque_controller", [f"{QOS}.depth:=-3"], f"{QOS}.depth=-3 must be >= 0"),
        ("uk_torque_controller", [f"{QOS}.depth:=five"], "qos_overrides of odom: "),
        ("plant_simulator", ["integration_step:=0.003"], "control_period=0.005 must be a multiple"),
        ("plant_simulator", ["suction_area:=.nan"], "suction_area=nan must be a finite number"),
    ],
)
def test_a_bad_parameter_is_refused_with_one_line(world, name, parameters, line):
    assert world.start_node(name, *parameters).wait(TIMEOUT) == 1
    (said,) = world.log(name).splitlines()
    assert said.startswith(f"{name}: ")
    assert line in said
    del world.processes[name]


@pytest.mark.parametrize(
    ("content", "wrong"), [("1 2\n", "1 point"), ("0 0\n1 nan\n", "line 2: point 2 is not finite")]
)
def test_a_bad_waypoint_file_is_refused_with_one_line(world, tmp_path, content, wrong):
    file = tmp_path / "points.txt"
    file.write_text(content)
    name = "trajectory_publisher"
    assert world.start_node(name, "shape:=waypoints", f"waypoints.file:={file}").wait(TIMEOUT) == 1
    (said,) = world.log(name).splitlines()
    assert f"waypoints.file='{file}'" in said
    assert wrong in said
    del world.processes[name]


@pytest.mark.installed
@pytest.mark.parametrize("name", NODES)
def test_a_missing_parameter_file_is_refused_without_a_traceback(world, name):
    assert world.start_node(name, config="nothing.yaml").wait(TIMEOUT) == 1
    assert "nothing.yaml" in world.log(name)
    assert "Traceback" not in world.log(name)
    del world.processes[name]


def run(world, name, *arguments):
    """What a node says that does not start, but ends by itself, and its status."""
    status = world.start(name, *map(str, arguments)).wait(TIMEOUT)
    del world.processes[name]
    return status, world.log(name).splitlines()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--params-file", "climber.yaml"], "--params-file must come after --ros-args"),
        (["-p", "mass:=5.0"], "-p must come after --ros-args"),
        (["--foo"], "unrecognized arguments: --foo"),
        (["climber.yaml"], "unrecognized arguments: climber.yaml"),
        (["--ros-args", "--foo"], "not known after --ros-args: '--foo'"),
        (["--ros-args", "-p", "mass:=5.0", "--", "stray"], "unrecognized arguments: stray"),
    ],
)
def test_arguments_that_mean_nothing_are_refused_with_one_line(world, arguments, line):
    name = "trajectory_publisher"
    status, said = run(world, name, *arguments)
    assert status in (1, 2)
    assert len(said) == 1
    assert said[0].startswith(f"{name}: {line}")


SHARED = "/**:\n  ros__parameters:\n    mass: 6\n"
OTHERS = "uk_controller:\n  ros__parameters:\n    mass: 6.0\n"


@pytest.mark.parametrize(
    ("name", "text", "has"),
    [
        *((name, OTHERS, "for NODE, but for uk_controller") for name in NODES),
        (NODES[0], "", "for NODE, but for no node"),
        (NODES[1], "# nothing yet\n", "for NODE, but for no node"),
        (NODES[1], SHARED.replace("mass: 6", "use_sim_time: n"), "for NODE but use_sim_time"),
        (NODES[2], OTHERS.replace("uk_controller", "/a/NODE"), "for NODE, but for /a/NODE"),
    ],
)
def test_a_file_that_has_nothing_for_a_node_does_not_start_the_papers_climber(
    world, tmp_path, name, text, has
):
    file = tmp_path / "mine.yaml"
    file.write_text(text.replace("NODE", name))
    status, said = run(world, name, "--ros-args", "--params-file", file, "-p", "use_sim_time:=true")
    wanted = has.replace("for NODE", f"for /{name}").replace("NODE", name)
    assert (status, said) == (1, [f"{name}: {file} has no parameters {wanted}"])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("/**/uk_torque_controller:\n  ros__parameters:\n    maas: 6.0\n", "did you mean mass?"),
        ("/**:\n  ros__parameters:\n    mass: 6.0\n    mass: 7.0\n", "has mass of /** twice"),
        ("/**:\n  ros__parameters:\n    mass: [6.0\n", "no parameter file"),
        ("/**:\n  ros__parameters:\n    mass:\n", "line 3: mass has no value"),
    ],
)
def test_what_is_wrong_in_a_file_is_said_in_one_line(world, tmp_path, text, line):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    status, said = run(world, "uk_torque_controller", "--ros-args", "--params-file", file)
    assert status == 1
    assert len(said) == 1
    assert said[0].startswith("uk_torque_controller: ")
    assert line in said[0]


def start(world, name, *arguments):
    """Log of a node that has started, without times and levels."""
    node = (name, "/")
    world.start(name, *map(str, arguments))
    world.wait(lambda: node in world.node.get_node_names_and_namespaces(), name)
    world.wait(lambda: "INFO" in world.log(name), "what it is")
    assert world.end(name) == 0
    # a slow machine may hold up a plant in the wall's time
    others = "safe output: ", " behind: left out"
    lines = [
        line for line in world.log(name).splitlines() if not any(text in line for text in others)
    ]
    return [line.split(f"[{name}]: ")[1] for line in lines]


@pytest.mark.parametrize("name", NODES[:2])
def test_parameters_may_be_shared_by_all_nodes_and_floats_be_integers(world, tmp_path, name):
    file = tmp_path / "shared.yaml"
    file.write_text(f"{SHARED}    shape: circle\n    circle: {{radius: 2}}\n    odom_frame: wall\n")
    said, remark = start(world, name, "--ros-args", "--params-file", file)
    others = "given to all nodes, but no parameter of this one: "
    if name == "trajectory_publisher":
        assert "3 of " in said
        assert "circle, 12.57 m" in said
        assert remark == f"{others}mass"
    else:
        assert "2 of " in said
        assert "6 kg" in said
        assert remark == f"{others}shape, circle.radius"


PAPER, CLIMBER = (
    ["--params-file", CONFIG / "paper.yaml"],
    ["--params-file", CONFIG / "climber.yaml"],
)


@pytest.mark.parametrize(
    ("name", "arguments", "parts"),
    [
        (
            "trajectory_publisher",
            [],
            [
                "defaults: the paper's scenario, up to 10 m/s",
                "ellipse, 51.05 m",
                "9.283 s",
                "at most 10 m/s",
                "smallest radius 3.6 m",
            ],
        ),
        (
            "trajectory_publisher",
            [*PAPER, "-p", "preview:=1.5"],
            ["6 of ", "paper.yaml, command line)", "without end"],
        ),
        (
            "uk_torque_controller",
            [],
            [
                "defaults: the paper's scenario",
                "5 kg, at most 20 N m a wheel, suction of 150 N, constraints guidance",
            ],
        ),
        (
            "uk_torque_controller",
            CLIMBER,
            ["19 of ", "climber.yaml)", "at most 4 N m", "suction of 480 N", "safe output hold"],
        ),
        (
            "uk_torque_controller",
            ["-p", "adhesion:=magnetic"],
            ["1 of ", "(command line)", "magnetic of 300 N"],
        ),
        (
            "plant_simulator",
            [],
            [
                "defaults: the paper's climber",
                "5 kg, wheeled, coulomb friction, suction of 150 N, wall plane, 200 Hz in the wall",
            ],
        ),
        (
            "plant_simulator",
            [*CLIMBER, "-p", "simulated_time:=true"],
            ["15 of ", "200 Hz in lock-step"],
        ),
        ("markers", [], ["defaults; wheels of radius 0.027 m, 0.6 m apart"]),
    ],
)
def test_a_node_says_in_its_first_line_what_it_is(world, name, arguments, parts):
    (said,) = start(world, name, "--ros-args", *arguments)
    assert [part for part in parts if part not in said] == []


@pytest.mark.parametrize(
    ("parameter", "meant"),
    [
        ("wheel_radius:=27.0", "if it is in mm, write 0.027"),
        ("inclination:=1.5708", "if it is in rad, write 90"),
        (
            "qos_overrides./odmo.subscription.depth:=5",
            "overrides nothing (did you mean qos_overrides./odom.subscription.depth?)",
        ),
        (
            "qos_overrides./odom.subscription.deph:=5",
            "overrides nothing (did you mean qos_overrides./odom.subscription.depth?)",
        ),
    ],
)
def test_what_can_hardly_be_meant_is_doubted_at_the_start(world, parameter, meant):
    _, doubt = start(world, "uk_torque_controller", "--ros-args", "-p", parameter)
    assert meant in doubt
    assert doubt.startswith(parameter.split(":=")[0])


@pytest.mark.installed
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_node_cleanly_even_if_it_comes_twice(world, number):
    processes = [world.start_node(name) for name in NODES]
    world.wait(lambda: set(NODES) <= set(world.node.get_node_names()), "nodes")
    for process in processes:
        process.send_signal(number)
    for name in NODES:
        assert world.end(name, number) == 0
        assert "Traceback" not in world.log(name)


@pytest.mark.skipif(installation() is not None, reason="what is installed is started as it is")
def test_what_the_tests_start_is_forked_which_takes_a_third_of_the_time(world):
    assert isinstance(world.start_node("markers"), Forked)
