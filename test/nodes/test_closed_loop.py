"""The main job, as people run it: three nodes and a recorder in processes of their own."""

import os
import signal
import time
from contextlib import suppress

import numpy as np
import pytest
from bag_contents import read_messages
from evo.core import metrics
from evo.tools import file_interface
from world import CONFIG, TIMEOUT, World, executable, inhabitants

from climber_uk.bags.recorded_run import read_run
from climber_uk.control.safety import Mode
from climber_uk.demo.run_demo import ENDLESS
from climber_uk.mechanics import SECOND
from climber_uk.messages import reading
from climber_uk.messages.topics import PRESSURE
from climber_uk.report import export_tum
from climber_uk.report.metrics import Case, evaluate
from climber_uk.report.trajectory_errors import absolute_errors, relative_errors

pytestmark = pytest.mark.nodes

ERROR = 2  # a level of diagnostic_msgs/DiagnosticStatus


def demo(world, output, config, *arguments, **how):
    """Start the demonstration; its output is `world.log("run_demo")`."""
    words = "--config", CONFIG / config, "--output", output, *arguments
    return world.run("run_demo", executable("run_demo"), *words, **how)


def finished(world):
    """What a demonstration has said, once it has ended well."""
    process = world.processes["run_demo"]
    if process.wait(300):
        logs = sorted(world.directory.rglob("*.log"))
        raise AssertionError("\n".join(f"{log}:\n{log.read_text()}" for log in logs))
    return world.log("run_demo")


def is_under_way(world):
    world.wait(lambda: "×" in world.log("run_demo"), "progress")


def hold_up_the_recorder(world):
    """Stop it for a while, once the run has begun, as a busy machine may."""
    is_under_way(world)
    recorders = [number for number, said in inhabitants(world) if "record_bag" in said]
    for recorder in recorders:  # none where all is over already
        with suppress(ProcessLookupError):
            os.kill(recorder, signal.SIGSTOP)
            time.sleep(0.1)
            os.kill(recorder, signal.SIGCONT)


def by_stamp(bag, topic, content):
    return {
        reading.nanoseconds(m.header.stamp): content(m) for _, _, m in read_messages(bag, [topic])
    }


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Directory and ROS domain of the runs that several tests look at."""
    world = World(tmp_path_factory.mktemp("runs"))
    yield world
    world.close()


@pytest.fixture(scope="module")
def paper_bags(runs):
    """2 s of a lap, and its first one again."""
    bags = [runs.directory / "first" / "bag", runs.directory / "second" / "bag"]
    for bag, duration in zip(bags, ["2", "1"], strict=True):
        demo(runs, bag.parent, "paper.yaml", "--duration", duration)
        hold_up_the_recorder(runs)
        finished(runs)
    return bags


SMALL = {  # a fifth of the size of climber.yaml's lap, in a fifth of its time
    "half_width: 1.5": "half_width: 0.3",
    "half_height: 0.75": "half_height: 0.15",
    "rate: 0.12": "rate: 0.6",
    "ramp_time: 3.0": "ramp_time: 1.0",
}
SLOW = {"control_period: 0.005": "control_period: 0.02"}
DURATION = 14.0  # [s] of that lap, and of rest after it


def small_bag(runs, name, duration, changed=SMALL, called=""):
    """Bag of a run with a configuration, of which some text is changed."""
    text = (CONFIG / name).read_text()
    for before, after in changed.items():
        assert before in text
        text = text.replace(before, after)
    config = runs.directory / f"small_{called}{name}"
    config.write_text(text)
    output = runs.directory / f"run_of_{called}{name}"
    demo(runs, output, config, "--duration", str(duration))
    finished(runs)
    return output / "bag"


@pytest.fixture(scope="module")
def climber_bag(runs):
    return small_bag(runs, "climber.yaml", DURATION, SMALL | SLOW)


@pytest.mark.soak  # without nodes: test/closed_loop/test_speed_motors.py
def test_a_motor_board_that_takes_speeds_follows_and_does_not_hunt(runs, replay):
    """In steps of 1 mm/s, with a dead band of 20 mm/s: below it a wheel stands.

    A whole lap, and rest after it: test/closed_loop/test_speed_motors.py.
    """
    dead_band = {"velocity_dead_band: 0.0": "velocity_dead_band: 0.02"}
    bag = small_bag(runs, "velocity.yaml", 3.0, SMALL | dead_band)
    run = read_run(bag)
    assert run.time[-1] >= 2.5
    assert np.sqrt(np.mean(run.distance**2)) < 3e-3
    told = np.array(list(by_stamp(bag, "/wheel_torques", lambda m: list(m.velocity)).values()))
    changes = 0.027 * np.diff(told, axis=0)
    assert np.sqrt(np.mean(changes**2)) < 3e-3
    assert not replay(bag, "--fail-above", "1e-9")["changed"]


def test_the_papers_scenario_in_lock_step_is_exact_and_repeats_to_the_last_bit(paper_bags):
    bags = paper_bags
    run = read_run(bags[0])
    assert run.time[-1] >= 2.0
    assert len(run.time) == round(run.time[-1] * 200) + 1  # not one is missing
    assert np.sqrt(np.mean(run.distance**2)) <= 0.05e-3
    assert run.distance.max() <= 0.15e-3
    assert np.abs(run.side_slip).max() < 1e-9

    def pose_and_twist(m):
        pose, twist = m.pose.pose, m.twist.twist
        return pose.position.x, pose.position.y, pose.orientation.z, twist.linear.x, twist.angular.z

    for topic, content in {
        "/odom": pose_and_twist,
        "/wheel_torques": lambda m: list(m.effort),
    }.items():
        first, second = (by_stamp(bag, topic, content) for bag in bags)
        common = sorted(first.keys() & second.keys())
        assert len(common) >= 190
        assert all(first[stamp] == second[stamp] for stamp in common)


def test_a_realistic_climber_goes_from_rest_to_rest(climber_bag):
    run = read_run(climber_bag)
    assert run.margins.values[:, :2].min() > 2.8
    assert np.abs(run.error[:, 1]).max() < 2e-3
    assert run.time[-1] >= DURATION
    # the last half second, in which it creeps home
    assert np.abs(run.pose[-25:] - run.pose[-1]).max() < 1e-6
    assert run.distance[-1] < 5e-3
    # it is told as it begins, not within a second of the wall's clock
    told = [time for time, event in run.events if event.text == Mode.FOLLOWING.value]
    assert told[0] < 0.1


@pytest.mark.soak  # without nodes: test/control/test_least_suction.py
def test_with_the_least_suction_it_drives_with_less_and_keeps_its_margins_and_its_path(runs):
    pump = "\n    suction:\n      pump_time: 0.1"
    asked = (
        "\n    least_suction:\n      enabled: true\n      slip_margin: 2.5\n      fall_rate: 1500.0"
    )
    changed = {
        "max_heading: 0.3": f"max_heading: 0.3{asked}{pump}",
        "integration_step: 0.0025": f"integration_step: 0.0025\n    setpoint_timeout: 0.5{pump}",
    }
    run = read_run(small_bag(runs, "climber.yaml", 4.0, SMALL | SLOW | changed, "least_suction_"))
    assert run.time[-1] >= 4.0
    pressure = run.recorded[PRESSURE].values[:, 0]
    assert pressure[0] == 8000.0  # at rest
    assert 5160.0 <= pressure.min() < 6500.0
    assert run.margins.values[:, 0].min() >= 2.5
    assert np.abs(run.error[:, 1]).max() < 2e-3
    numbers = evaluate(Case(run))
    assert 65.0 < numbers["mean_suction"] < 95.0
    assert 0.0 < numbers["seal_work_share"] < numbers["mean_suction"]  # it rests with all of it
    assert numbers["errors"] == 0


def test_in_lock_step_a_replay_gives_the_recorded_torques(paper_bags, climber_bag, replay):
    for bag, answers in ((paper_bags[0], 390), (climber_bag, 690)):
        numbers = replay(bag, "--fail-above", "1e-9")
        odometry, torques = (set(by_stamp(bag, of, str)) for of in ("/odom", "/wheel_torques"))
        # the recorder may end between the last odometries and their references and answers;
        # before there is a clock, a safe output may have the stamp 0
        assert not [stamp for stamp in torques - odometry if 0 < stamp < max(odometry)]
        recorded = len(torques & odometry)
        assert numbers["answers"]["in both"] >= recorded >= answers
        assert not numbers["changed"]
        stamps = sorted(torques & odometry)
        seconds = (stamps[-1] - stamps[0]) / SECOND
        for modes in numbers["modes"].values():
            assert [mode for since, mode in modes if since < seconds][-1] == "following"
    file = CONFIG / "paper.yaml"
    assert not replay(paper_bags[1], "--params", file, "--fail-above", "1e-9")["changed"]


def test_a_replay_that_expects_more_friction_asks_for_its_torque_until_it_has_learnt(
    paper_bags, replay
):
    """By hand: r Δf / 2 a wheel, Δf = (1 - k) Δμ P S; the observer finds it with 100/s."""
    more, observer = "seal_friction_coefficient:=0.9", "observer.bandwidth:=0.0"
    by_hand = 0.027 / 2 * 0.47 * 0.1 * 2500 * 0.06
    numbers = replay(paper_bags[0], "-p", more, "-p", observer)
    assert numbers["changed"]["seal_friction_coefficient"] == [0.8, 0.9]
    wheels = numbers["wheels"]
    assert wheels["difference, RMS [N m]"] == pytest.approx([by_hand] * 2, rel=0.02)
    wheels = replay(paper_bags[0], "-p", more)["wheels"]
    assert wheels["difference, largest [N m]"] == pytest.approx([by_hand] * 2, rel=0.02)
    assert wheels["largest at [s]"] == [0.0, 0.0]
    # no more in all of the 2 s than if it were wrong for 25 ms, and then right
    assert max(wheels["difference, RMS [N m]"]) < by_hand * (0.025 / 2) ** 0.5


def test_evo_reads_the_exported_trajectories_and_finds_our_errors(
    paper_bags, tmp_path, monkeypatch
):
    words = "export_tum", paper_bags[0], "--output", tmp_path
    monkeypatch.setattr("sys.argv", [str(word) for word in words])
    export_tum.main()
    read = file_interface.read_tum_trajectory_file
    reference, odometry, truth = (
        read(tmp_path / f"{name}.tum") for name in ("reference", "odom", "ground_truth")
    )
    # these sensors have no errors; the recorder may have ended between the two
    number = min(odometry.num_poses, truth.num_poses)
    assert number >= 390
    for one in ("timestamps", "positions_xyz", "orientations_quat_wxyz"):
        np.testing.assert_array_equal(getattr(odometry, one)[:number], getattr(truth, one)[:number])
    run = read_run(paper_bags[0])
    assert odometry.num_poses == len(run.time)
    both = run.reference, run.pose
    way = np.insert(np.cumsum(np.hypot(*np.diff(run.pose[:, :2], axis=0).T)), 0, 0.0)
    for column, relation in enumerate(
        (metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad)
    ):
        for measure, errors in (
            (metrics.APE(relation), absolute_errors(*both)),
            (metrics.RPE(relation, 200), relative_errors(*both, run.time, 1.0)),
            (
                metrics.RPE(relation, 1.0, metrics.Unit.meters),
                relative_errors(*both, way, 1.0),
            ),
        ):
            measure.process_data((reference, odometry))
            np.testing.assert_allclose(errors[:, column], measure.error, atol=1e-6)


@pytest.mark.soak  # each node alone: test_uk_torque_controller.py, test_plant_simulator.py
def test_a_climber_that_loses_its_suction_is_stopped_in_time_and_falls_in_the_end(world, tmp_path):
    """The pump fails at 1 s, with 0.6 s to the volume: P = 8 kPa exp((1 - t) / 0.6)."""
    config = tmp_path / "lost.yaml"
    lost = "initial_y: 3.0\n    pressure_loss_time: 1.0\n    suction:\n      pump_time: 0.6"
    text = (CONFIG / "climber.yaml").read_text().replace("initial_y: 3.0", lost)
    config.write_text(text.replace("control_period: 0.005", "control_period: 0.01"))
    demo(world, tmp_path / "run", config, "--duration", "8")
    assert "fell off: tip margin" in finished(world)
    states, stopped, errors = {}, [], []
    for topic, _, message in read_messages(
        tmp_path / "run" / "bag", ["/ground_truth", "/diagnostics"]
    ):
        time = reading.nanoseconds(message.header.stamp) / SECOND - 1.0
        if topic == "/ground_truth":
            states[time] = message.twist.twist.linear.x
            continue
        for status in message.status:
            if status.level == ERROR:
                errors.append(status.name)
                if "suction pressure too low" in status.message:
                    stopped.append(time)
    # at 5 kPa, told every 0.1 s; by hand: 8 exp((1 - t) / 0.6) = 5
    assert stopped[0] == pytest.approx(1.0 + 0.6 * np.log(8 / 5), abs=0.11)
    assert {"/uk_torque_controller", "/plant_simulator"} <= set(errors)
    # by hand: P S l/2 = m g h
    falls = 1.0 + 0.6 * np.log(8000 * 0.06 * 0.125 / (5 * 9.81 * 0.05))
    assert max(states) == pytest.approx(falls, abs=0.01)
    assert states[max(time for time in states if time < falls - 1.0)] == 0.0  # it stood by then


@pytest.mark.soak  # 10 s
@pytest.mark.parametrize(
    ("path", "lasts"),
    [
        ("shape: line\n    line: {length: 0.1}\n    rest_to_rest: {rate: 0.1, ramp_time: 1.0}", 4),
        ("shape: circle\n    time_law: constant_rate\n    constant_rate: {rate: 0.1}", ENDLESS),
    ],
)
def test_a_demo_lasts_as_long_as_its_path(world, tmp_path, path, lasts):
    """By hand: 0.1 m at 0.1 m/s with two ramps of 1 s takes 2 s, and 1.5 s of rest follow."""
    config = tmp_path / "own.yaml"
    config.write_text(
        f"/**/trajectory_publisher:\n  ros__parameters:\n    {path}\n"
        "/**/uk_torque_controller:\n  ros__parameters: {control_period: 0.02}\n"
        "/**/plant_simulator:\n  ros__parameters: {control_period: 0.02}\n"
    )
    demo(world, tmp_path / "run", config)
    said = finished(world)
    assert f"{lasts:.1f} of {lasts:.1f} s" in said
    assert "not finished" not in said


@pytest.mark.soak  # of two: test_extending.py
def test_climbers_in_one_time_keep_their_names_apart(world, tmp_path):
    """Two of the four in the file."""
    demo(world, tmp_path / "run", "four_climbers.yaml", "--climbers", "2", "--duration", "1")
    finished(world)
    bag, names = tmp_path / "run" / "bag", [f"climber_{number}" for number in (1, 2)]
    stamps, frames, tellers = {name: set() for name in names}, set(), set()
    for topic, _, message in read_messages(bag):
        if topic.endswith("/odom"):
            frames.add((topic, message.header.frame_id, message.child_frame_id))
            stamps[topic.split("/")[1]].add(reading.nanoseconds(message.header.stamp))
        elif topic == "/diagnostics":
            tellers |= {status.name for status in message.status}
    assert frames == {(f"/{n}/odom", f"{n}/odom", f"{n}/base_link") for n in names}
    nodes = "plant_simulator", "uk_torque_controller"
    assert {f"/{name}/{node}" for name in names for node in nodes} <= tellers
    assert all(teller.split("/")[1] in names for teller in tellers)
    assert len({tuple(sorted(stamps[name])[:200]) for name in names}) == 1  # one time, 1 s of it
    ways = []
    for name in names:
        run = read_run(bag, name)
        assert np.abs(run.error[:, 1]).max() < 2e-3
        ways.append(tuple(run.pose[-1] - run.pose[0]))
    assert len(set(ways)) == 2


@pytest.mark.soak  # as nodes without a demo: test_faults.py; as a demo: test_processes.py
def test_on_the_wall_clock_the_climber_stays_on_the_path(world, tmp_path):
    # The machine may be busy, and not keep to it all the time: what an idle one does is shown by
    # `make demo CLOCK=wall`
    demo(world, tmp_path / "run", "climber.yaml", "--clock", "wall", "--duration", "4")
    finished(world)
    run = read_run(tmp_path / "run" / "bag")
    assert 3 < run.time[-1] < 20  # that of the configuration
    assert np.median(run.distance[run.time > 2.5]) < 0.05
    assert np.median(np.abs(run.error[:, 1])) < 0.05
    assert run.distance.max() < 0.3  # where the guard is late, too: it does not run away


def test_what_a_demo_cannot_start_with_is_said_in_one_line(world, tmp_path):
    assert demo(world, tmp_path / "run", "nothing.yaml").wait(TIMEOUT) == 1
    (said,) = world.log("run_demo").splitlines()
    assert said.startswith("run_demo: No such file or directory: ")
    del world.processes["run_demo"]


def test_a_path_that_begins_too_far_off_is_refused_before_anything_is_started(world, tmp_path):
    text = (CONFIG / "climber.yaml").read_text().replace("initial_y: 3.0", "initial_y: 0.0")
    (tmp_path / "mine.yaml").write_text(text)
    assert demo(world, tmp_path / "run", tmp_path / "mine.yaml").wait(TIMEOUT) == 1
    (said,) = world.log("run_demo").splitlines()
    assert "plant_simulator starts 3.00 m and 0.00 rad off where the path begins" in said
    assert not (tmp_path / "run").exists()
    del world.processes["run_demo"]
