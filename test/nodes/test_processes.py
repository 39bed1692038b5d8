"""Whatever starts processes ends them, however it ends itself, and a bag is complete."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest
from world import CONFIG, TIMEOUT, World, executable

from climber_uk.bags.recorded_run import read_run

pytestmark = pytest.mark.nodes

DEMO = ["--config", CONFIG / "paper.yaml", "--output"]
PARENT = [sys.executable, "-c", "import subprocess, sys; subprocess.run(sys.argv[1:])"]


def parent_of(pid):
    """Id of the parent of a process; None if it is gone, or only waits to be asked how it ended."""
    try:
        state, parent, *_ = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None
    return None if state == "Z" else int(parent)


def descendants(pid):
    """Ids of all processes that a process has started, and these, and so on."""
    found = set()
    for thread in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):  # it has ended meanwhile
            children = {int(child) for child in thread.read_text().split()}
            found |= {child for child in children if parent_of(child) is not None}
    return found.union(*map(descendants, found))


def interrupt_twice(process):
    os.killpg(process.pid, signal.SIGINT)
    os.killpg(process.pid, signal.SIGINT)


def close_the_terminal(process):
    os.killpg(process.pid, signal.SIGHUP)


def kill(process):
    process.kill()


@pytest.fixture
def start(world):
    """Start a command as the leader of a group of its own; nothing of it outlives the test."""
    started = []

    def begin(*command):
        environment = {**world.environment, "PYTHONUNBUFFERED": "1"}
        process = subprocess.Popen(
            [*map(str, command)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=environment,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        for pid in [*descendants(process.pid), process.pid]:
            if parent_of(pid) is not None:
                os.kill(pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()


def is_under_way(process):
    """Wait for its progress."""
    while (said := process.stdout.read(1)) != "×":
        assert said


def gone(world, pids):
    world.wait(lambda: not any(map(parent_of, pids)), "end of all processes")


@pytest.mark.parametrize(
    ("end", "by_another"),
    [
        pytest.param(kill, False, marks=pytest.mark.soak),
        (kill, True),
        pytest.param(interrupt_twice, True, marks=pytest.mark.soak),
        pytest.param(close_the_terminal, False, marks=pytest.mark.soak),
    ],
    ids=["kill-alone", "kill-under make", "interrupt_twice-under make", "close_the_terminal-alone"],
)
def test_a_demo_that_is_ended_leaves_no_process_and_a_complete_bag(
    world, start, tmp_path, end, by_another
):
    command = [executable("run_demo"), *DEMO, tmp_path / "run"]
    of_another, alone = [*PARENT, *command, "--with-parent"], [*command, "--clock", "wall"]
    process = start(*(of_another if by_another else alone))
    is_under_way(process)
    family = descendants(process.pid)
    assert len(family) == 4 + by_another
    end(process)
    said = process.stdout.read()  # or it would wait for somebody to read how far it is
    assert by_another or "Traceback" not in said  # the other one is told, too
    gone(world, {*family, process.pid})
    assert (tmp_path / "run" / "bag" / "metadata.yaml").is_file()
    assert len(read_run(tmp_path / "run" / "bag").time) > 10


def test_a_demo_that_is_ended_before_it_began_leaves_nothing(world, start, tmp_path):
    process = start(executable("run_demo"), *DEMO, tmp_path / "run")
    world.wait(lambda: len(family := descendants(process.pid)) == 4 and family, "the nodes")
    family = descendants(process.pid)
    process.terminate()
    assert process.communicate(timeout=TIMEOUT)[0].splitlines()[-1] == "run_demo: interrupted"
    gone(world, family)
    assert not (tmp_path / "run").exists()


@pytest.mark.soak  # 40 s
def test_a_demo_does_not_wait_long_for_a_node_that_does_not_end_once_it_is_told_twice(
    world, start, tmp_path
):
    process = start(executable("run_demo"), *DEMO, tmp_path / "run")
    is_under_way(process)
    family = descendants(process.pid)
    for pid in family:
        os.kill(pid, signal.SIGSTOP)
    interrupt_twice(process)
    said = process.stdout.read()
    gone(world, family)
    assert "run_demo: interrupted, and record_bag, " in said
    assert " did not end, and was killed; recorded so far" in said
    assert process.wait(TIMEOUT) == 1


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (("mass: 5.0", "mass: -5.0"), "mass=-5.0 must be > 0 [kg]"),
        pytest.param(
            *(("semi_axis_x: 10.0", "semi_axis_z: 10.0"), "(did you mean ellipse.semi_axis_"),
            marks=pytest.mark.soak,
        ),
        pytest.param(
            ("/**/uk_torque_controller", "/**/controller"),
            "no parameters for /uk_torque_controller",
            marks=pytest.mark.soak,
        ),
    ],
)
def test_a_demo_that_cannot_start_says_why_and_leaves_nothing(start, tmp_path, wrong, said):
    file = tmp_path / "mine.yaml"
    file.write_text((CONFIG / "paper.yaml").read_text().replace(*wrong))
    process = start(executable("run_demo"), "--config", file, "-o", tmp_path / "run")
    lines = process.communicate(timeout=TIMEOUT)[0].splitlines()
    assert process.returncode == 1
    assert lines[-1].startswith("run_demo: ")
    assert said in lines[-1]
    assert not (tmp_path / "run").exists()


def test_a_demo_doubts_before_it_starts_what_its_nodes_would_doubt_in_their_logs(start, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text((CONFIG / "paper.yaml").read_text().replace("mass: 5.0", "mass: 5000.0"))
    process = start(executable("run_demo"), "--config", file, "-o", "/dev/null/run")
    doubt, _ = process.communicate(timeout=TIMEOUT)[0].splitlines()  # once for all nodes
    assert doubt.startswith(f"run_demo: {file}: mass=5000 [kg] is hardly meant")
    assert doubt.endswith("if it is in g, write 5")


def test_a_test_ends_what_was_started_in_it_and_nothing_else_in_its_domain(tmp_path):
    """Who runs the tests may have robots, a shell or an editor in that domain."""
    ended = World(tmp_path)
    sleep = ["sleep", "600"]
    elsewhere = subprocess.Popen(sleep, env={**os.environ, "ROS_DOMAIN_ID": str(ended.domain)})
    ended.run("shell", *PARENT, *sleep)
    ended.wait(lambda: descendants(ended.processes["shell"].pid), "what the shell starts")
    (deep,) = descendants(ended.processes["shell"].pid)
    try:
        ended.close()
        deadline = time.monotonic() + TIMEOUT
        while parent_of(deep) is not None:
            assert time.monotonic() < deadline
        assert parent_of(elsewhere.pid) == os.getpid()
    finally:
        elsewhere.kill()
        elsewhere.wait()


@pytest.mark.parametrize("place", ["/dev/null/run", "/proc/run"])
def test_where_nothing_can_be_written_a_demo_says_so(start, place):
    process = start(executable("run_demo"), *DEMO, place)
    (line,) = process.communicate(timeout=TIMEOUT)[0].splitlines()
    assert process.returncode == 1
    assert line.startswith("run_demo: ")
    assert place in line


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_recorder_that_is_ended_twice_has_finished_its_bag(world, start, tmp_path, number):
    process = start(executable("record_bag"), "-o", tmp_path / "bag", "--topics", "/rosout")
    world.wait(lambda: "recording" in process.stdout.readline(), "the recorder")
    process.send_signal(number)
    process.send_signal(number)
    assert "messages in" in process.communicate(timeout=TIMEOUT)[0]
    assert process.returncode == 0
    assert (tmp_path / "bag" / "metadata.yaml").is_file()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_check_driver_ends_in_words(world, start, number):
    process = start(executable("check_driver"), "--duration", "60")
    node = ("check_driver", "/")
    world.wait(lambda: node in world.node.get_node_names_and_namespaces(), "check_driver")
    process.send_signal(number)
    process.send_signal(number)
    assert process.communicate(timeout=TIMEOUT)[0] == "check_driver: interrupted\n"
    assert process.returncode == 2


def test_a_run_of_a_campaign_again_ends_with_its_demo(world, start, tmp_path):
    file = tmp_path / "short.yaml"
    text = (CONFIG / "campaign.yaml").read_text().replace("base: ", f"base: {CONFIG}/")
    file.write_text(text.replace("duration: 20.0", "duration: 2.0"))
    process = start(executable("campaign"), file, "--rerun", "1", "-o", tmp_path / "run")
    world.wait(lambda: len(descendants(process.pid)) == 5, "the demo")
    family = descendants(process.pid)
    interrupt_twice(process)
    process.communicate(timeout=TIMEOUT)
    gone(world, family)


def test_a_terminal_that_is_closed_does_not_end_what_nohup_started(world):
    world.run("nohup", "nohup", str(executable("markers")))
    node = ("markers", "/")
    world.wait(lambda: node in world.node.get_node_names_and_namespaces(), "markers")
    process = world.processes["nohup"]
    process.send_signal(signal.SIGHUP)
    assert process.poll() is None
    assert world.end("nohup") == 0


@pytest.mark.parametrize("end", [interrupt_twice, kill])
@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["reproduce_paper", "-o"], marks=pytest.mark.soak),
        ["campaign", CONFIG / "campaign.yaml", "--jobs", "2", "-o"],
    ],
    ids=lambda command: command[0],
)
def test_what_computes_in_many_processes_ends_with_all_of_them(
    world, start, tmp_path, command, end
):
    process = start(executable(command[0]), *command[1:], tmp_path / "out")
    # one more keeps account of their semaphores
    family = world.wait(
        lambda: len(found := descendants(process.pid)) > 2 and found, "processes that compute"
    )
    end(process)
    said = process.communicate(timeout=TIMEOUT)[0]
    gone(world, family)
    assert end is kill or f"{command[0]}: interrupted" in said.splitlines()[-1]
