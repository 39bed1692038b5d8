"""Every executable tells its use and its version, and refuses what it does not know in one line."""

import json
import os
import re
import signal
import subprocess
import sys
from argparse import ArgumentTypeError
from importlib.metadata import entry_points, version

import pytest

from climber_uk.system.command_line import whole

pytestmark = pytest.mark.slow

OURS = {
    script.name: script
    for script in entry_points(group="console_scripts")
    if script.value.startswith("climber_uk.")
}
# what each `main` does with some arguments, each in turn: its status and its output; what they
# import once for all, as that is most of a start; each forked, as a node has its process end soon
TRY = """
import contextlib, importlib, io, json, os, sys
modules, *tries = sys.argv[1:]
mains = {name: importlib.import_module(of).main for name, of in json.loads(modules).items()}
for name, main in mains.items():
    if os.fork():
        os.wait()
        continue
    for word in tries:
        sys.argv = [name, word]
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                status = main()
            except SystemExit as end:
                status = end.code
        print(json.dumps([status, out.getvalue(), err.getvalue()]), flush=True)
    os._exit(0)
"""
SILENT = {
    *("trajectory_publisher", "uk_torque_controller", "plant_simulator", "markers", "check_driver"),
    *("wall_odometry", "climber"),
}  # they write no files
TRIES = ["--help", "--version", "--foo", "-o"]


@pytest.mark.parametrize("text", ["0", "101", "-3", "1.5", "1e1", "x", "", "9" * 5000, "²"])
def test_a_number_that_is_to_be_whole_is_refused_beyond_its_bounds(text):
    with pytest.raises(ArgumentTypeError, match="must be an integer from 1 to 100"):
        whole(1, 100)(text)


def spoken(code, **environment):
    """Status, output and errors of a tool whose `main` does `code`."""
    code = (
        "from climber_uk.system.command_line import Parser\n"
        f"Parser('tool', 'of µm').arguments()\n{code}"
    )
    command = [sys.executable, "-c", code]
    ran = subprocess.run(command, capture_output=True, env=os.environ | environment, timeout=60)
    return ran.returncode, ran.stdout, ran.stderr.decode()


def test_ctrl_c_ends_a_tool_in_a_line_and_an_error_of_ours_in_a_traceback():
    status, _, said = spoken("import signal; signal.raise_signal(signal.SIGINT)")
    assert (status, said) == (-signal.SIGINT, "tool: interrupted\n")
    assert "ZeroDivisionError" in spoken("1 / 0")[2]


@pytest.mark.parametrize("ignored", [False, True])
def test_ctrl_c_while_a_tool_imports_what_it_needs_ends_it_in_a_line(ignored):
    """Not in the background, where it is ignored."""
    code = (
        "import signal, sys\n"
        "from climber_uk.executables import system\n"
        f"{'signal.signal(signal.SIGINT, signal.SIG_IGN)' if ignored else ''}\n"
        "class Finder:\n"
        "    def find_spec(self, name, *_):\n"
        "        signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Finder())\n"
        "sys.argv = ['bin/tool']\n"
        "system.nothing()"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    if ignored:
        assert "ModuleNotFoundError: No module named 'climber_uk.system.nothing'" in ran.stderr
    else:
        assert (ran.returncode, ran.stderr) == (-signal.SIGINT, "tool: interrupted\n")


def test_a_stream_that_was_closed_does_not_lead_into_a_file_of_somebody(tmp_path):
    file = tmp_path / "file"
    code = f"""
import os, subprocess, sys
from climber_uk.system.command_line import Parser
from climber_uk.system.exits import exit_after
Parser("tool", None).arguments([])
with open({str(file)!r}, "w") as file:
    print("said")
    print("said", file=sys.stderr)
    os.write(1, b"said")
    subprocess.run(["sh", "-c", "echo said; echo said >&2"], check=True)
    file.write("kept")
exit_after(60.0, 0)
sys.exit(0 if sys.stdin.read() == "" else 1)
"""
    command = ["bash", "-c", 'exec "$0" -c "$1" <&- >&- 2>&-', sys.executable, code]
    assert subprocess.run(command, timeout=60).returncode == 0
    assert file.read_text() == "kept"


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_what_a_terminal_cannot_show_is_written_otherwise(encoding):
    status, out, _ = spoken("print('σ \\udcff')", PYTHONIOENCODING=encoding)
    assert (status, out) == (0, b"\\u03c3 \\udcff\n")


def test_all_executables_of_the_package_are_tried():
    assert {"trajectory_publisher", "run_demo", "markers", "campaign", "identify"} <= OURS.keys()
    assert len(OURS) >= 14


def test_an_executable_tells_its_use_and_its_version_and_refuses_what_it_does_not_know():
    modules = {name: f"climber_uk.{script.attr}" for name, script in OURS.items()}
    command = [sys.executable, "-c", TRY, json.dumps(modules), *TRIES]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert ran.stderr == ""
    answers = iter(map(json.loads, ran.stdout.splitlines()))
    for name in OURS:
        use, told, *refused = (next(answers) for _ in TRIES)
        assert use[0] in (0, None)
        assert use[1].startswith(f"usage: {name} ")
        assert "--version" in use[1]
        options = set(re.findall(r"(?<![-\w])-[-\w]+", use[1]))
        assert ({"--output", "-o"} <= options) == (name not in SILENT)
        assert told == [0, f"{name} {version('climber_uk')}\n", ""]
        for status, out, err in refused:
            assert (status, out) == (2, "")
            assert err.startswith(f"{name}: ")
            assert err.endswith(f"(see {name} --help)\n")
            assert len(err.splitlines()) == 1
