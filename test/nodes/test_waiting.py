"""The reference waits for its climber, and nothing runs away: the three nodes in lock-step."""

import math
import signal
from itertools import pairwise

import numpy as np
import pytest
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, TimeReference
from std_srvs.srv import SetBool
from test_faults import CONTROLLER, LOCK_STEP, PLANNER, PLANT, Climb, said
from world import CONFIG

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.messages import reading, writing
from climber_uk.parameters.parameter_file import Values, read_file

pytestmark = pytest.mark.nodes
FASTEST = 0.26  # [m/s] of the reference in config/climber.yaml


class Waiting(Climb):
    """A climb of which is heard where on its reference it is."""

    def __init__(self, world, changed=None, usual=LOCK_STEP):
        changed = changed or {}
        parameters = {name: [*usual[name], *changed.get(name, [])] for name in usual}
        # before there are nodes: what they say first counts
        self.positions = world.hear(TimeReference, "reference_time", 1000)
        super().__init__(world, parameters)
        self._seen = 0  # number of the position that was waited for

    def enable(self, enabled):
        self._seen = len(self.positions)
        self.world.call(SetBool, f"{CONTROLLER}/enable", SetBool.Request(data=enabled))

    @property
    def now(self):
        """Time of the plant [s]."""
        return reading.nanoseconds(self.odometry[-1].header.stamp) / SECOND

    @property
    def position(self):
        """Time of the reference [s]."""
        return reading.nanoseconds(self.positions[-1].time_ref) / SECOND

    @property
    def place(self):
        """Time of the reference and that of the plant [s] by one message: others may be late."""
        message = self.positions[-1]
        times = message.time_ref, message.header.stamp
        return [reading.nanoseconds(time) / SECOND for time in times]

    def passes(self, seconds):
        self.world.wait(lambda: self.odometry, "odometry")
        until = self.now + seconds
        self.world.wait(lambda: self.now >= until, f"{seconds} s of simulated time")

    def comes_to(self, condition, what):
        """Position at which a mode meets a condition, the first since what was waited for last."""

        def is_there():
            while self._seen < len(self.positions):
                if condition(self.positions[self._seen].source):
                    return self.positions[self._seen]
                self._seen += 1
            return None

        return self.world.wait(is_there, what)

    def is_in(self, mode):
        """Wait for a mode; time of the plant [s] of which it is told."""
        told = self.comes_to(lambda found: found == mode, mode)
        return reading.nanoseconds(told.header.stamp) / SECOND

    def fastest(self, since=0.0):
        return max(
            abs(m.twist.twist.linear.x)
            for m in self.odometry
            if reading.nanoseconds(m.header.stamp) >= since * SECOND
        )

    def off_the_path(self, since):
        """Largest distance [m] from the path as a curve."""
        path = build_trajectory(Values(read_file(CONFIG / "climber.yaml", f"/{PLANNER}")).read)
        curve = path.at(np.arange(0.0, 57.0, 0.01)).pose[:, :2]
        places = [
            (m.pose.pose.position.x, m.pose.pose.position.y)
            for m in self.odometry
            if reading.nanoseconds(m.header.stamp) >= since * SECOND
        ]
        return max(np.hypot(*(curve - place).T).min() for place in places[::20])


def test_enabled_late_it_begins_at_the_beginning_and_disabled_in_mid_course_goes_on_there(world):
    climb = Waiting(world)
    climb.enable(False)
    climb.is_in("disabled")
    climb.passes(0.5)
    waits_at = climb.position
    climb.passes(0.5)
    assert climb.position == waits_at
    _, begin = climb.place
    climb.enable(True)
    climb.is_in("following")
    position, since = climb.place  # time runs on while a service is called
    assert waits_at <= position <= waits_at + since - begin + 0.5
    climb.passes(2.0)
    later, now = climb.place
    assert later - position == pytest.approx(now - since, abs=0.5)
    climb.enable(False)
    climb.is_in("disabled")
    climb.passes(1.0)
    waits_at = climb.position
    climb.passes(0.5)
    assert climb.position == waits_at
    _, again = climb.place
    climb.enable(True)
    climb.is_in("following")
    climb.passes(1.0)
    assert climb.fastest() <= 1.3 * FASTEST
    assert climb.off_the_path(begin) < 0.02
    position, now = climb.place
    assert position < waits_at + now - again + 0.5


def test_a_process_that_was_stopped_or_is_a_new_one_goes_on_where_it_was(world):
    climb = Waiting(world)
    climb.is_in("following")
    climb.passes(2.0)
    for name in (CONTROLLER, PLANNER):
        world.processes[name].send_signal(signal.SIGSTOP)
        looks = iter(range(25))  # half a second: the clock of a plant in lock-step stands still
        world.wait(lambda looks=looks: next(looks, None) is None, "a while")
        world.processes[name].send_signal(signal.SIGCONT)
        climb.passes(0.5)
        climb.is_on_path()
    before = climb.position
    climb.kill(CONTROLLER)
    climb.start(CONTROLLER)
    climb.passes(1.5)
    climb.is_on_path()
    assert climb.fastest() <= 1.3 * FASTEST
    assert before - 1.0 < climb.position <= climb.now


@pytest.mark.soak
@pytest.mark.parametrize("name", [CONTROLLER, PLANNER])
def test_a_process_that_was_stopped_for_long_on_the_wall_clock_goes_on_where_it_was(world, name):
    climb = Waiting(world, usual={PLANT: [], CONTROLLER: ["guard.attempts:=1000"], PLANNER: []})
    climb.is_in("following")
    climb.passes(5.0)
    world.processes[name].send_signal(signal.SIGSTOP)
    climb.passes(5.0)  # a planner has given a second of its path
    waits_at, begin = climb.position, len(climb.positions)
    climb.passes(15.0)
    assert climb.position == waits_at
    world.processes[name].send_signal(signal.SIGCONT)
    world.wait(lambda: climb.position > waits_at + 3.0, "3 s more of the reference")
    times = [reading.nanoseconds(m.time_ref) / SECOND for m in climb.positions[begin:]]
    assert waits_at - 0.1 < min(times)
    assert max(later - time for time, later in pairwise(times)) < 0.5
    assert climb.fastest() <= 1.3 * FASTEST
    assert climb.off_the_path(0.0) < 0.02


def test_a_start_3_m_off_is_refused_in_words(world):
    climb = Waiting(world, {PLANT: ["initial_y:=0.0"]})
    climb.is_in("too_far")
    climb.passes(0.5)
    assert climb.fastest() < 1e-3
    (line,) = (text for text in said(world, CONTROLLER) if text.startswith("too far"))
    assert line.startswith("too far from the reference (3.00 m, from (0.00, 0.00) to (0.00, 3.00)")


def test_a_start_that_is_allowed_to_be_far_off_is_approached_at_its_speed(world):
    allowed = ["max_start_distance:=2.0", "approach_speed:=0.8"]
    climb = Waiting(world, {PLANT: ["initial_y:=1.5"], CONTROLLER: allowed})
    said = (
        "approaching the reference (1.50 m away)"  # its modes come before they are heard, perhaps
    )
    world.wait(lambda: said in world.log(CONTROLLER), said)
    begin = climb.is_in("following")
    assert climb.fastest() < 0.84
    climb.passes(1.5)
    assert climb.off_the_path(begin) < 0.02


def test_a_push_is_ridden_out(world):
    climb = Waiting(world, {PLANT: ["push_timeout:=0.3"]})
    climb.is_in("following")
    climb.passes(1.5)
    push = world.speak(WrenchStamped, "push")
    wrench = WrenchStamped()
    wrench.header.frame_id = "base_link"
    wrench.wrench.force.x = -150.0  # for push_timeout
    push.publish(wrench)
    climb.is_in("too_fast")
    climb.is_in("following")
    climb.passes(3.0)
    climb.is_on_path()
    assert climb.fastest(climb.now - 1.0) <= 1.3 * FASTEST


def test_a_motor_that_dies_is_noticed_and_the_climber_comes_to_rest(world):
    """A relay between controller and plant takes the torque of the left wheel away."""
    tracks = ["slip:=true", "locomotion:=tracked", "tracked.length:=0.44"]
    tracks.append("tracked.scrub_friction_coefficient:=0.8")
    to_plant = world.node.create_publisher(JointState, "applied_torques", 1000)
    dies_at = math.inf

    def relay(message):
        if reading.nanoseconds(message.header.stamp) >= dies_at * SECOND:
            message.effort[0] = 0.0
        to_plant.publish(message)

    world.node.create_subscription(JointState, "wheel_torques", relay, 1000)
    world.hear(JointState, "applied_torques")  # what the plant waits for
    climb = Waiting(world, {PLANT: [*tracks, "/wheel_torques:=/applied_torques"]})
    climb.is_in("following")
    known = {"following", "approaching", "waiting"}
    climb.passes(4.0)  # soon after the start it takes longer: it stands again, and nothing shows
    dies_at = climb.now
    fault = climb.comes_to(lambda mode: mode not in known, "fault")
    assert reading.nanoseconds(fault.header.stamp) / SECOND < dies_at + 0.35
    climb.passes(2.0)
    assert climb.fastest() < 1.5 * FASTEST + 0.1
    assert climb.fastest(climb.now - 0.5) < 0.01
    dies_at = math.inf  # it was mended
    climb.enable(True)
    climb.is_in("following")


def test_what_comes_and_goes_is_said_a_few_times_only(world):
    """A thousand odometries, every second one unfit."""
    world.start_node(CONTROLLER, "odometry_timeout:=10.0", config="climber.yaml")
    torques = world.listen(JointState, "wheel_torques")
    odometry = world.speak(Odometry, "odom")
    state = State(np.zeros(3), np.zeros(3))
    for number in range(1000):
        stamp = world.node.get_clock().now().nanoseconds
        message = writing.odometry(state, stamp, "odom", "base_link")
        if number % 2:
            message.pose.pose.position.x = math.nan
        odometry.publish(message)
        world.spin(0.001)
    world.wait(lambda: len(torques) > 100, "answers")
    assert len(world.log(CONTROLLER).splitlines()) <= 20
