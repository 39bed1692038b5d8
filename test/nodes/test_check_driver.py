"""check_driver finds no fault in the plant, and each one that is planted, by its name."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState
from world import CONFIG, TIMEOUT, executable

from climber_uk.driver_check import timing
from climber_uk.driver_check.node import DriverNode

pytestmark = pytest.mark.nodes

FAULTY = Path(__file__).parent / "faulty_driver.py"
PARAMETERS = "--ros-args", "--params-file", str(CONFIG / "climber.yaml")
BY_SPEEDS = "--ros-args", "--params-file", str(CONFIG / "velocity.yaml")
# odometry may be late on a busy machine
PATIENT = (*PARAMETERS, "-p", "odometry_timeout:=2.0")
PACED = "simulated_time:=true", "real_time_factor:=2.0"  # it has to be found meanwhile
WHEELS_SWAPPED = "left and right are swapped"
SENSORS = {"imu", "gravity", "gyro", "fixes"}  # that not every driver has
# fault: what finds it, a word of what it says
FAULTS = {
    "swapped wheels": ("wheels", WHEELS_SWAPPED),
    "wrong sign": ("wheels", "both wheels turn the wrong way"),
    "swapped wheels and wrong sign": ("wheels", f"{WHEELS_SWAPPED}, and both turn the wrong way"),
    "right wheel reversed": ("wheels", "the right wheel turns the wrong way"),
    "left wheel reversed": ("wheels", "the left wheel turns the wrong way"),
    "right wheel dead": ("wheels", "the right wheel does nothing"),
    "left wheel dead": ("wheels", "the left wheel does nothing"),
    "no torque": ("wheels", "no reaction"),
    "twice the torque": ("gain", "drives 2.0"),
    "half the torque": ("gain", "drives 0.5"),
    "degrees": ("heading", "in degrees"),
    "clockwise": ("heading", "opposite ways"),
    "degrees per second": ("heading", "in degrees per second"),
    "no twist": ("heading", "is zero"),
    "world-frame twist": ("twist", "twist.linear is in odom, not in base_link"),
    "centimetres": ("twist", "times as fast as twist.linear"),
    "sideways": ("slip", "sideways"),
    "not a number": ("finite", "nan"),
    "no orientation": ("finite", "unit turn about z"),
    "no covariance": ("covariance", "all zero"),
    "negative covariance": ("covariance", "negative"),
    "covariance not a number": ("covariance", "not finite"),
    "wrong frame": ("frames", "'map'"),
    "wrong child frame": ("frames", "'base_footprint'"),
}
WALL_CLOCK_FAULTS = {
    "no watchdog": ("watchdog", "still "),
    "stale stamps": ("age", "ms old"),
    "stamps of the future": ("age", "ahead of the clock"),
    "zero stamps": ("clock", "zero"),
    "stamps since boot": ("clock", "time since boot"),
    "stuck stamps": ("order", "the same as"),
    "stamps that go back": ("order", "older than"),
    "uneven stamps": ("jitter", "% of a period"),
    "wrong type": ("topic", "geometry_msgs/msg/PoseStamped"),
    "two publishers": ("publishers", "2 publish"),
    "nobody listens": ("commands", "nobody"),
    "listens to another type": ("commands", "Float64MultiArray"),
    "listens to latched torques": ("commands", "would not get"),
}
WARNINGS = {
    "half the rate": ("rate", "100.0 Hz"),
    "best effort": ("qos", "best effort"),
    "late torque": ("latency", "ms from a torque"),
}

BUSY = {"age", "latency"}  # may be late on a busy machine
IN_BRIEF = ("world-frame twist",)
IN_BRIEF_ON_WALL_CLOCK = ("stale stamps",)


def some(faults, brief):
    """Faults as parameters of a test: all of them in soak, some in brief."""
    marks = {name: () if name in brief else (pytest.mark.soak,) for name in faults}
    return [pytest.param(name, *faults[name], marks=marks[name], id=name) for name in faults]


def check(world, *arguments, parameters=PARAMETERS):
    """Run check_driver to its end; return its exit status, rows by check, and stderr."""
    done = subprocess.run(
        [executable("check_driver"), "--json", *arguments, *parameters],
        env=world.environment,
        capture_output=True,
        text=True,
        timeout=4 * TIMEOUT,
    )
    rows = json.loads(done.stdout)["rows"] if done.stdout else []
    return done.returncode, {row["check"]: row for row in rows}, done.stderr


def those(rows, verdict):
    return [name for name, row in rows.items() if row["verdict"] == verdict]


def told(rows):
    return "\n".join(f"{r['verdict']} {r['check']}: {r['said']}" for r in rows.values())


def drive(world, fault, *parameters, board=PARAMETERS):
    world.run("driver", sys.executable, FAULTY, fault, *board, *parameters)


@pytest.mark.parametrize(
    ("clock", "parameters", "skipped"),
    [
        ("true", (*PARAMETERS, "-p", "use_sim_time:=true"), {"watchdog", "servo"}),
        # a machine that is busy moves it too far
        pytest.param("false", PATIENT, {"servo"}, marks=pytest.mark.soak),
    ],
)
def test_the_plant_passes_all_checks(world, clock, parameters, skipped):
    world.start_node("plant_simulator", f"simulated_time:={clock}", config="climber.yaml")
    world.wait(lambda: world.node.count_publishers("odom"), "the plant")
    status, rows, said = check(world, "--move", "--duration", "0.5", parameters=parameters)
    assert status == 0, told(rows)
    assert not those(rows, "fail"), told(rows)
    assert set(those(rows, "skip")) == skipped | SENSORS, told(rows)
    assert set(those(rows, "warn")) <= BUSY, told(rows)
    assert "is going to turn left, drive forward, back and turn right" in said


@pytest.mark.soak
def test_with_a_controller_in_lock_step_it_listens_and_refuses_to_move(world):
    slow = "control_period:=0.02"
    world.start_node("plant_simulator", *PACED, slow, config="climber.yaml")
    world.start_node("uk_torque_controller", "use_sim_time:=true", slow, config="climber.yaml")
    quick = "use_sim_time:=true", "rest_to_rest.ramp_time:=1.0"
    world.start_node("trajectory_publisher", *quick, config="climber.yaml")
    odometry = world.listen(Odometry, "odom")
    world.wait(lambda: odometry and odometry[-1].twist.twist.linear.x > 0.1, "motion")
    sim_time = (*PARAMETERS, "-p", "use_sim_time:=true", "-p", slow)
    status, rows, _ = check(world, "--move", "--duration", "1", parameters=sim_time)
    assert status == 1
    assert those(rows, "fail") == ["trial"], told(rows)
    assert "/uk_torque_controller publishes wheel_torques" in rows["trial"]["said"]
    # where its heading is near 0 just then, the twist's frame cannot be told
    assert set(those(rows, "warn")) <= {"twist"}, told(rows)
    assert {"heading", "slip", "clock"} <= set(those(rows, "pass"))


def test_odometry_that_waited_for_it_is_no_older(world):
    """In lock-step with a controller it may be slower than the two, and must not blame them."""
    world.start_node("plant_simulator", "simulated_time:=true", config="climber.yaml")
    rclpy.init(args=[*PARAMETERS, "-p", "use_sim_time:=true"], domain_id=world.domain)
    node, executor = DriverNode(), SingleThreadedExecutor()
    executor.add_node(node)
    try:
        odometry = world.listen(Odometry, "odom")
        world.wait(node.has_clock, "clock")
        for other in ("uk_torque_controller", "trajectory_publisher"):
            world.start_node(other, "use_sim_time:=true", config="climber.yaml")
        world.wait(lambda: len(odometry) > 200, "1 s of simulated time")
        while len(node.arrivals) < 150:
            executor.spin_once(timeout_sec=TIMEOUT)
        said = timing.age(node.evidence()).said
        assert float(said.split()[0]) < 10, said  # two control periods [ms]
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown()


def test_when_it_is_interrupted_its_last_word_is_no_torque(world):
    slow = "control_period:=0.02"
    paced = "simulated_time:=true", "real_time_factor:=1.0"  # it is interrupted in mid-course
    world.start_node(
        "plant_simulator", *paced, "command_timeout:=60.0", slow, config="climber.yaml"
    )
    told = world.hear(JointState, "wheel_torques")
    sim_time = (*PARAMETERS, "-p", "use_sim_time:=true", "-p", slow)
    world.start("check_driver", "--move", "--duration", "0.5", *sim_time)
    world.wait(lambda: told and any(told[-1].effort), "torque")
    assert world.end("check_driver", signal.SIGINT) == 2
    assert world.log("check_driver").endswith("check_driver: interrupted\n")
    world.wait(lambda: not any(told[-1].effort), "zero torque")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--ros-args", "-p", "mass:=-1.0"], "mass=-1.0 must be > 0 [kg]"),
        (["--ros-args", "--params-file", "nowhere.yaml"], "nowhere.yaml"),
    ],
    ids=["bad value", "no file"],
)
def test_what_it_cannot_do_is_one_line_and_status_2(world, arguments, said):
    status, rows, error = check(world, *arguments, parameters=())
    assert (status, rows) == (2, {})
    assert said in error.splitlines()[-1]
    assert "Traceback" not in error


BOARDS = {"torques": PARAMETERS, "speeds": BY_SPEEDS}


@pytest.mark.parametrize(
    ("board", "fault", "check_name", "said"),
    [
        pytest.param(board, *row.values, marks=row.marks, id=f"{board}, {row.id}")
        for board, brief in (("torques", IN_BRIEF), ("speeds", ()))
        for row in some(FAULTS, brief)
    ],
)
def test_a_planted_fault_is_found_by_name_and_nothing_else(world, board, fault, check_name, said):
    """In lock-step, which the check itself answers."""
    drive(world, fault, "-p", "simulated_time:=true", board=BOARDS[board])
    sim_time = (*BOARDS[board], "-p", "use_sim_time:=true")
    status, rows, _ = check(world, "--move", "--duration", "0.5", parameters=sim_time)
    assert those(rows, "fail") == [check_name], told(rows)
    assert said in rows[check_name]["said"]
    assert rows[check_name]["hint"]
    assert not those(rows, "warn"), told(rows)
    assert status == 1


@pytest.mark.parametrize(
    ("fault", "check_name", "said"), some(WALL_CLOCK_FAULTS, IN_BRIEF_ON_WALL_CLOCK)
)
def test_a_fault_in_time_is_found_by_name_and_nothing_else(world, fault, check_name, said):
    """On the wall clock, with --move: a driver that is not fit for it is not moved."""
    drive(world, fault)
    status, rows, _ = check(world, "--move", "--duration", "1")
    assert those(rows, "fail") == [check_name], told(rows)
    assert said in rows[check_name]["said"]
    assert status == 1


@pytest.mark.soak
def test_a_board_that_takes_speeds_passes_and_has_its_watchdog_tried(world):
    world.start_node("plant_simulator", config="velocity.yaml")
    status, rows, _ = check(world, "--move", "--duration", "1", parameters=BY_SPEEDS)
    assert status == 0, told(rows)
    assert not those(rows, "fail"), told(rows)
    assert set(those(rows, "skip")) == SENSORS, told(rows)
    assert rows["servo"]["values"]["time_constant"] == pytest.approx(0.02, abs=0.01)


@pytest.mark.soak
def test_a_board_that_takes_speeds_and_has_no_watchdog_is_told(world):
    drive(world, "no watchdog", board=BY_SPEEDS)
    _, rows, _ = check(world, "--move", "--duration", "1", parameters=BY_SPEEDS)
    assert those(rows, "fail") == ["watchdog"], told(rows)
    assert "still turns" in rows["watchdog"]["said"]


@pytest.mark.soak
@pytest.mark.parametrize(("fault", "check_name", "said"), some(WARNINGS, WARNINGS))
def test_what_is_only_unusual_is_a_warning(world, fault, check_name, said):
    drive(world, fault)
    status, rows, _ = check(world, "--move", "--duration", "1")
    assert not those(rows, "fail"), told(rows)
    assert {check_name} <= set(those(rows, "warn")) <= {check_name, *BUSY}, told(rows)
    assert said in rows[check_name]["said"]
    assert status == 0
