"""An operator pauses a climber on its path, goes on, slower, and back: the three nodes."""

import json
import re
import subprocess

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Path
from std_msgs.msg import Bool, Float64
from std_srvs.srv import SetBool, Trigger
from test_faults import LIMIT, LOCK_STEP, PLANNER, PLANT
from test_waiting import Waiting
from world import CONFIG, TIMEOUT, executable

from climber_uk.messages import reading, writing
from climber_uk.messages.topics import PROGRESS
from climber_uk.operating.command import DO
from climber_uk.planning.progress import Progress

pytestmark = pytest.mark.nodes


class Operated(Waiting):
    """A climb with an operator, in their time: else it would end meanwhile."""

    def __init__(self, world, changed):
        slow = {
            name: [word.replace("period:=0.02", "period:=0.04") for word in words]
            for name, words in LOCK_STEP.items()
        }
        slow[PLANT].append("real_time_factor:=1.0")
        super().__init__(world, changed, slow)
        self.progress = world.listen(DiagnosticArray, f"{PLANNER}/progress")

    def pause(self, paused):
        asked = SetBool.Request(data=paused)
        return self.world.call(SetBool, f"{PLANNER}/pause", asked)

    def command(self, *words):
        """Status and output of `climber` with some arguments."""
        asked = self.world.start("climber", *words)
        del self.world.processes["climber"]  # it may fail
        try:
            self.world.wait(lambda: asked.poll() is not None, "an answer to a command")
            return asked.returncode, self.world.log("climber")
        finally:
            asked.kill()

    def ask(self, service):
        return self.world.call(Trigger, f"{PLANNER}/{service}", Trigger.Request())

    def is_told_to_be(self, state):
        """Wait until progress is told to be in a state, even if it is in another soon after.

        Numbers of then by name, once odometry of then has come as well.
        """
        first = len(self.progress)

        def told():
            return next((m for m in self.progress[first:] if m.status[0].message == state), None)

        found = self.world.wait(told, state)
        then = stamp_of(found)
        self.world.wait(lambda: stamp_of(self.odometry[-1]) >= then, "odometry of then")
        values = found.status[0].values
        return {pair.key: float(pair.value) for pair in values if pair.key != "mode"}

    def drives(self, low, high, since=None):
        """Wait until its speed [m/s] is, or `since` odometry of this number was, so for 0.5 s."""
        first = max(len(self.odometry) - 12, 0) if since is None else since

        def is_so():
            speeds = [m.twist.twist.linear.x for m in self.odometry[first:]]
            fits = "".join("+" if low <= speed <= high else "-" for speed in speeds)
            return 12 * "+" in fits

        self.world.wait(is_so, f"a speed of {low} to {high} m/s")

    def largest_jump(self):
        efforts = np.array([m.effort for m in self.torques])
        return np.abs(np.diff(efforts, axis=0)).max()


def press(world, panel):
    """What foxglove_bridge does when a button of the layout is pressed; the service's response."""
    layout = json.loads((CONFIG / "foxglove_layout.json").read_text())
    button = layout["configById"][panel]
    if panel.startswith("Publish"):
        return world.speak(Float64, button["topicName"]).publish(
            Float64(**json.loads(button["value"]))
        )
    kind = Trigger if button["requestPayload"] == "{}" else SetBool
    asked = kind.Request(**json.loads(button["requestPayload"]))
    response = world.call(kind, button["serviceName"], asked)
    assert response.success, response.message
    return response


def stamp_of(message):
    return reading.nanoseconds(message.header.stamp)


def path(places, frame="odom"):
    message = Path()
    message.header.frame_id = frame
    for x, y in places:
        message.poses.append(PoseStamped())
        message.poses[-1].pose.position.x, message.poses[-1].pose.position.y = x, y
    return message


def test_a_path_from_outside_is_taken_up_in_mid_course_or_refused_in_words(world):
    line = ["shape:=line", "line.length:=4.0", "rest_to_rest.rate:=0.2"]
    climb = Operated(world, {PLANNER: line, PLANT: ["initial_heading:=0.0"]})
    climb.drives(0.18, 0.21)
    given = world.speak(Path, "path")
    given.publish(path([(0.0, 0.0), (1.0, 1.0)], "map"))
    given.publish(path([(0.0, 0.0), (float("nan"), 1.0)]))
    given.publish(path([(1.0, 1.0), (1.0, 1.0)]))
    for why in (
        "path: refused: frame_id='map' must be 'odom'",
        "path: refused: pose 2 at (nan, 1, 0) is not finite",
        "path: refused: path: all points are within 0.00333 m",
    ):
        world.wait(lambda why=why: why in world.log(PLANNER), why)
    corner = path([(2.0, 3.0), (2.0, 3.5), (1.5, 3.5)])
    given.publish(corner)  # at once: simulated time does not wait for it
    given.publish(corner)
    world.wait(lambda: "comes to rest, then starts" in world.log(PLANNER), "a path taken up")
    climb.is_told_to_be("done")
    end = climb.odometry[-1].pose.pose.position
    assert (end.x, end.y) == pytest.approx((1.5, 3.5), abs=0.01)
    assert world.log(PLANNER).count("path taken") == 1
    assert "path starts at" in world.log(PLANNER)


def test_paused_slower_and_back_it_stays_on_its_path_and_tells_how_far_it_is(world):
    line = ["shape:=line", "line.length:=2.0", "rest_to_rest.rate:=0.3"]
    start = ["initial_heading:=0.0"]
    climb = Operated(world, {PLANNER: line, PLANT: start})
    climb.drives(0.28, 0.31)
    assert climb.pause(True).success
    paused = climb.is_told_to_be("paused")
    climb.drives(-1e-3, 1e-3)
    assert paused["done"] + paused["left"] == pytest.approx(2.0, abs=1e-6)
    x = climb.odometry[-1].pose.pose.position.x
    assert paused["done"] == pytest.approx(x, abs=0.01)
    assert climb.is_told_to_be("paused")["done"] == pytest.approx(paused["done"], abs=1e-6)

    world.speak(Float64, f"{PLANNER}/speed").publish(Float64(data=0.5))
    assert climb.command("resume") == (0, "goes on\n")
    climb.drives(0.14, 0.16)
    world.speak(Float64, f"{PLANNER}/speed").publish(Float64(data=1.5))
    world.wait(
        lambda: "out of range Min: 0.01, Max: 1.0, value: 1.5" in world.log(PLANNER),
        "a refusal in words",
    )
    climb.drives(0.14, 0.16)
    status, said = climb.command("speed", "1.5")
    assert (status, "out of range" in said) == (1, True)
    status, said = climb.command("status")
    assert status == 0
    assert said.startswith(("following, ", "done, "))  # by simulated time, which runs on
    since = len(climb.odometry)
    assert climb.command("retreat") == (0, "goes back along the path\n")
    climb.drives(-0.16, -0.14, since)
    back = climb.is_told_to_be("done")
    assert back["done"] == pytest.approx(0.0, abs=1e-6)
    climb.drives(-1e-3, 1e-3)
    assert climb.odometry[-1].pose.pose.position.x == pytest.approx(0.0, abs=0.01)
    assert "done: at the beginning" in world.log(PLANNER)

    assert climb.command("speed", "1.0") == (0, "speed 1\n")
    assert climb.ask("start").message == "starts at the next odometry"
    climb.drives(0.28, 0.31)
    # a stick, or ros2_control, may be there, of another type
    assert not any(map(world.node.count_publishers, ("cmd_vel", "effort_controller/commands")))
    assert all(abs(torque) <= LIMIT for m in climb.torques for torque in m.effort)
    assert max(abs(m.pose.pose.position.y - 3.0) for m in climb.odometry) < 0.01


def test_the_buttons_of_the_viewers_layout_do_what_is_written_on_them(world):
    line = ["shape:=line", "line.length:=4.0", "rest_to_rest.rate:=0.3"]
    climb = Operated(world, {PLANNER: line, PLANT: ["initial_heading:=0.0"]})
    climb.drives(0.28, 0.31)
    press(world, "CallService!pause")
    climb.is_told_to_be("paused")
    climb.drives(-1e-3, 1e-3)
    press(world, "Publish!speed")
    press(world, "CallService!go_on")
    climb.drives(0.14, 0.16)
    press(world, "CallService!disable")
    climb.is_in("disabled")
    press(world, "CallService!enable")
    climb.is_in("following")
    assert press(world, "CallService!start").message == "comes to rest, then starts"
    started = "line starts at"
    world.wait(lambda: world.log(PLANNER).count(started) == 2, "another start")


def test_tags_of_a_path_are_told_as_the_climber_reaches_them(world):
    file = world.directory / "points.csv"
    file.write_text("x,y,speed,dwell,tag\n0,0,,,begin\n0.4,0,0.1,1,photo\n0.8,0,,,end\n")
    path = ["shape:=waypoints", f"waypoints.file:={file}", "rest_to_rest.rate:=0.3"]
    climb = Operated(world, {PLANNER: path, "plant_simulator": ["initial_heading:=0.0"]})
    events = world.listen(DiagnosticArray, f"{PLANNER}/events")
    assert climb.ask("start").success  # the first may have been told before we listened
    events.clear()
    world.wait(lambda: [e for e in events if e.status[0].message == "end"], "the last tag")
    assert [e.status[0].message for e in events][-3:] == ["begin", "photo", "end"]
    where = {pair.key: float(pair.value) for pair in events[-2].status[0].values}
    assert (where["x"], where["y"]) == pytest.approx((0.4, 3.0), abs=1e-6)
    at = stamp_of(events[-2])
    stamps = [stamp_of(m) for m in climb.odometry]
    then = climb.odometry[int(np.searchsorted(stamps, at))]
    assert then.pose.pose.position.x == pytest.approx(0.4, abs=0.01)


@pytest.mark.soak
def test_a_stick_takes_over_and_gives_back_what_it_has_left(world):
    line = ["shape:=line", "line.length:=4.0", "rest_to_rest.rate:=0.3"]
    by_hand = ["by_hand.input:=twist_stamped", "by_hand.speed:=0.2", "by_hand.lock:=true"]
    heading = ["initial_heading:=0.0"]
    climb = Operated(world, {PLANNER: [*line, *by_hand], PLANT: heading})
    climb.drives(0.28, 0.31)
    stick = world.speak(TwistStamped, "cmd_vel")
    asked = TwistStamped()
    asked.twist.linear.x, asked.twist.angular.z = 1.0, 0.3  # cut to 0.2

    lock = world.speak(Bool, "by_hand_lock")

    def drives(speed, yaw_rate):
        stick.publish(asked)
        last = [m.twist.twist for m in climb.odometry[-15:]]
        return all(
            abs(twist.linear.x - speed) < 0.01 and abs(twist.angular.z - yaw_rate) < 0.02
            for twist in last
        )

    world.wait(lambda: drives(0.2, 0.3), "a turn by hand")
    lock.publish(Bool(data=True))
    world.wait(lambda: drives(0.0, 0.0), "rest, though the stick is moved")
    lock.publish(Bool(data=False))
    world.wait(lambda: drives(0.2, 0.3), "a turn by hand again")
    climb.drives(-1e-3, 1e-3)  # the stick is silent
    climb.is_told_to_be("by hand")
    left = climb.odometry[-1].pose.pose.position
    assert left.y > 3.02
    assert "back to the path" in climb.pause(False).message
    climb.is_told_to_be("following")
    climb.is_told_to_be("done")
    end = climb.odometry[-1].pose.pose.position
    assert (end.x, end.y) == pytest.approx((4.0, 3.0), abs=0.01)


@pytest.mark.soak
def test_the_command_does_all_it_is_there_for(world):
    line = ["shape:=line", "line.length:=4.0", "rest_to_rest.rate:=0.3"]
    climb = Operated(world, {PLANNER: line, PLANT: ["initial_heading:=0.0"]})
    climb.drives(0.28, 0.31)
    does = {
        "pause": r"comes to rest within [\d.]+ s",
        "resume": "goes on",
        "speed 0.5": "speed 0.5",
        "status": r"following, .* m done, .* m left, .* s, lap 1, segment 1",
        "push 20 0": r"pushed by \(20, 0\) N",
        "disable": "inactive",
        "enable": "active",
        "stop": r"comes to rest within [\d.]+ s|rests where it is|comes to rest where it is",
        "retreat": "goes back along the path",
        "watch": r"(?s).*\n(following|done), 0\.0\d m done, .*",
        "start": "starts at the next odometry",
    }
    assert {words.split()[0] for words in does} == {*DO}
    for words, said in does.items():
        status, told = climb.command(*words.split())
        assert (status, bool(re.fullmatch(said, told.strip()))) == (0, True), (words, told)


def test_the_command_tells_when_nobody_answers_and_what_it_takes(world):
    for words, status, said in (
        (("pause", "--timeout", "0.3"), 3, "nobody answers: service /trajectory_publisher/pause"),
        (("watch", "--timeout", "0.3", "--namespace", "/climber_2"), 3, "topic /climber_2/"),
        (("speed",), 2, "speed takes 1 number(s), not 0"),
        (("fly",), 2, "invalid choice: 'fly'"),
    ):
        command = [executable("climber"), *words]
        done = subprocess.run(command, env=world.environment, capture_output=True, text=True)
        assert done.returncode == status
        assert said in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_a_climber_that_falls_silent_is_not_shown_as_it_was(world):
    """As if its nodes had been killed: nobody is waited for in front of what they told last."""
    told = writing.progress("planner", vars(Progress("following", left=2.0, time_left=3.0)), 0)
    planner = world.node.create_publisher(DiagnosticArray, f"/{PROGRESS}", 10)
    watch = world.run("climber", executable("climber"), "watch", "--timeout", "3")

    def is_shown():
        planner.publish(told)
        return "following" in world.log("climber")

    world.wait(is_shown, "what is watched")
    assert watch.wait(TIMEOUT) == 3
    *_, shown, said = world.log("climber").splitlines()
    assert shown == "planner  –"
    assert "nobody answers: topic /trajectory_publisher/progress" in said
