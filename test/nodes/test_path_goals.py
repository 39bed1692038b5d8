"""Paths as goals: against the definition of Nav2's FollowPath, by a client as Nav2 has it."""

import signal

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from generated_interface import importable
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from rclpy.action import ActionClient
from sensor_msgs.msg import TimeReference
from std_srvs.srv import SetBool

from climber_uk.messages import reading

pytestmark = pytest.mark.nodes
ABORTED, CANCELED, SUCCEEDED = (
    getattr(GoalStatus, f"STATUS_{name}") for name in ("ABORTED", "CANCELED", "SUCCEEDED")
)
FASTER = "rest_to_rest.rate:=0.25", "rest_to_rest.ramp_time:=1.0"
PLANNER, CONTROLLER = "trajectory_publisher", "uk_torque_controller"


@pytest.fixture(scope="module")
def definition(tmp_path_factory):
    """Where nav2_msgs is found, and its FollowPath: made for these tests where there is none."""
    with importable("nav2_msgs", tmp_path_factory.mktemp("nav2_msgs")):
        from nav2_msgs.action import FollowPath

        yield FollowPath


class Goals:
    """A climber in lock-step, or in the wall clock's time, and a client that sends it goals."""

    def __init__(self, world, action, *parameters, lock_step=True):
        self.world, self.action = world, action
        time, period = f"use_sim_time:={str(lock_step).lower()}", "control_period:=0.02"
        for node, more in {
            "plant_simulator": [f"simulated_time:={str(lock_step).lower()}", period],
            CONTROLLER: [time, period],
            PLANNER: [time, "autostart:=false", *FASTER, *parameters],
        }.items():
            world.start_node(node, *more, config="climber.yaml")
        self.odometry = world.listen(Odometry, "odom")
        self.client = ActionClient(world.node, action, "follow_path")
        world.wait(self.client.server_is_ready, "the action")

    def send(self, *places, frame="odom"):
        """Goal of a path through places, with what is told of it meanwhile."""
        path = Path(poses=[PoseStamped() for _ in places])
        path.header.frame_id = frame
        for stamped, (x, y) in zip(path.poses, places, strict=True):
            stamped.pose.position.x, stamped.pose.position.y = float(x), float(y)
        goal = self.action.Goal(path=path, controller_id="FollowPath")
        told = []
        sent = self.client.send_goal_async(goal, lambda message: told.append(message.feedback))
        self.world.wait(sent.done, "word of the goal")
        assert sent.result().accepted
        return Sent(self.world, sent.result(), told)

    @property
    def here(self):
        pose = self.odometry[-1].pose.pose.position
        return np.array([pose.x, pose.y])

    def rests(self):
        """Where it is once odometry, which may come after a goal's result, tells of its rest."""
        self.world.wait(lambda: self.speed < 1e-3, "its rest")
        return self.here

    @property
    def speed(self):
        return abs(self.odometry[-1].twist.twist.linear.x)

    def now(self):
        return reading.nanoseconds(self.odometry[-1].header.stamp)


class Sent:
    """A goal that was sent: its handle, what was told of it, and in the end its result."""

    def __init__(self, world, handle, told):
        self.world, self.handle, self.told = world, handle, told
        self.ended = handle.get_result_async()

    def drives(self, metres):
        self.world.wait(
            lambda: self.told and self.told[0].distance_to_goal - self.left > metres, "its way"
        )

    @property
    def left(self):
        return self.told[-1].distance_to_goal

    def end(self):
        """Status, error code and message."""
        self.world.wait(self.ended.done, "the end of the goal")
        result = self.ended.result().result
        return self.ended.result().status, result.error_code, result.error_msg


UP = [(0.0, 3.0), (0.3, 3.3), (0.9, 3.9)]
LEVEL = [(0.3, 3.3), (1.3, 3.3)]
RIGHT = np.array([0.2, 0.0])


def test_goals_are_refused_driven_replaced_cancelled_and_reached(definition, world):
    goals, codes = Goals(world, definition), definition.Result
    for places, frame, why in (
        (UP[:1], "odom", "1 pose(s), want 2"),
        (UP, "map", "frame_id='map' must be 'odom'"),
        ([(0, 3), (float("nan"), 3)], "odom", "pose 2 at (nan, 3, 0) is not finite"),
        ([(0, 3), (0, 3)], "odom", "refused"),
    ):
        status, code, said = goals.send(*places, frame=frame).end()
        assert (status, code) == (ABORTED, codes.INVALID_PATH)
        assert why in said

    first = goals.send(*UP)
    first.drives(0.1)
    assert max(feedback.speed for feedback in first.told) > 0.02
    assert first.told[0].distance_to_goal == pytest.approx(0.9 * 2**0.5, rel=0.02)
    assert goals.send((5.0, 5.0)).end()[0] == ABORTED  # what is refused stops nothing
    second = goals.send(*LEVEL)
    assert first.end() == (ABORTED, codes.UNKNOWN, "another path took over")

    second.drives(0.1)
    world.wait(second.handle.cancel_goal_async().done, "word of it")
    status, code, said = second.end()
    assert (status, code) == (CANCELED, codes.NONE)
    assert "at rest on the path" in said
    rested = goals.rests()
    assert rested[1] == pytest.approx(3.3, abs=5e-3)
    assert 0.35 < rested[0] < 1.2

    third = goals.send(rested, rested + RIGHT)
    assert third.end() == (SUCCEEDED, codes.NONE, "it is driven to its end")
    assert goals.here == pytest.approx(rested + RIGHT, abs=5e-3)
    assert third.left < third.told[0].distance_to_goal
    assert np.all(np.diff([feedback.distance_to_goal for feedback in third.told]) <= 1e-6)


@pytest.mark.soak
def test_a_goal_fails_that_is_not_followed_and_another_is_driven_then(definition, world):
    goals, codes = Goals(world, definition, "goal_patience:=1.0"), definition.Result
    first = goals.send(*UP)
    first.drives(0.1)
    assert world.call(SetBool, f"{CONTROLLER}/enable", SetBool.Request(data=False)).success
    status, code, said = first.end()
    assert (status, code) == (ABORTED, codes.FAILED_TO_MAKE_PROGRESS)
    assert "the controller does not follow for 1 s: disabled" in said
    assert world.call(SetBool, f"{CONTROLLER}/enable", SetBool.Request(data=True)).success
    since = goals.now()
    world.wait(lambda: goals.now() > since + 5_000_000_000, "5 s")
    rested = goals.rests()
    assert np.hypot(*(rested - UP[0])) < 0.9  # of 1.27 m: it is paused
    assert goals.send(rested, rested + RIGHT).end()[0] == SUCCEEDED

    begin = goals.here + RIGHT
    cancelled = goals.send(begin, begin + RIGHT)
    world.wait(lambda: goals.speed > 0.02, "its way to the beginning")
    world.wait(cancelled.handle.cancel_goal_async().done, "word of it")
    status, _, said = cancelled.end()
    assert (status, said) == (CANCELED, "cancelled: at rest where it was")
    assert np.hypot(*(goals.rests() - begin)) > 0.05


@pytest.mark.soak
def test_a_goal_fails_whose_controller_is_lost_and_another_is_driven_by_the_next_one(
    definition, world
):
    goals, codes = (
        Goals(world, definition, "goal_patience:=6.0", lock_step=False),
        definition.Result,
    )
    first = goals.send(*UP)
    first.drives(0.05)
    world.end(CONTROLLER, signal.SIGKILL)
    lost = ABORTED, codes.CONTROLLER_TIMED_OUT, "the controller is not heard for 6 s"
    assert first.end() == lost
    assert goals.send(*UP).end() == lost
    followed = world.hear(TimeReference, "reference_time")
    world.start_node(CONTROLLER, config="climber.yaml")
    world.wait(lambda: "following" in [message.source for message in followed], "the next one")
    assert goals.send(goals.here, goals.here + RIGHT).end()[0] == SUCCEEDED


@pytest.mark.soak
def test_an_operators_pause_outlasts_a_goal_and_what_takes_over_ends_it(definition, world):
    goals = Goals(world, definition)
    first = goals.send(*UP)
    first.drives(0.1)
    pause = f"{PLANNER}/pause"
    assert world.call(SetBool, pause, SetBool.Request(data=True)).success
    second = goals.send(*LEVEL)
    assert first.end()[0] == ABORTED
    world.wait(lambda: len(second.told) > 20, "feedback")
    assert goals.speed < 0.01
    assert second.left == pytest.approx(1.0, rel=0.02)
    assert world.call(SetBool, pause, SetBool.Request(data=False)).success
    second.drives(0.1)
    publisher = world.speak(Path, "path")
    path = Path(poses=[PoseStamped(), PoseStamped()])
    path.header.frame_id = "odom"
    path.poses[0].pose.position.y = path.poses[1].pose.position.y = 3.5
    path.poses[1].pose.position.x = 0.5
    publisher.publish(path)
    assert second.end()[0] == ABORTED
    assert "path" in world.log(PLANNER)
