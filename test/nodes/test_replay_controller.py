"""A controller to which all sorts of things happened, recorded and replayed."""

import numpy as np
import pytest
from bag_contents import read_messages
from mcap.reader import make_reader
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from reference_points import reference_point
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import SetBool
from trajectory_msgs.msg import MultiDOFJointTrajectory
from world import World

from climber_uk.bags.bag_writer import BagWriter
from climber_uk.bags.storage import TYPESTORE
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages import writing

pytestmark = pytest.mark.nodes

NAME = "uk_torque_controller"
CIRCLE = Trajectory(Circle(), ConstantRate(rate=0.5))
GAIN = "guidance.cross_track_gain"
EXACT = "--fail-above", "1e-9"


class Lockstep:
    """A plant's part, a step at a time: a climber that wobbles about a circle."""

    def __init__(self, world):
        self.world, self.step = world, 0
        # its poses are not where its twist leads: that would be learnt as a side slip; and it obeys
        # no torque, which no disturbance explains, nor a motor
        free = "guard.max_disturbance:=0.0", "guard.response_time:=0.0"
        world.start_node(NAME, "use_sim_time:=true", "observer.side_slip_bandwidth:=0.0", *free)
        self.torques = world.listen(JointState, "wheel_torques")
        self.odometry = world.speak(Odometry, "odom")
        self.clock = world.speak(Clock, "/clock")
        self.pressure = world.speak(FluidPressure, "suction_pressure")
        reference = world.speak(MultiDOFJointTrajectory, "reference")
        world.start("record_bag", "--output", str(world.directory / "bag"))
        for publisher in (self.odometry, self.clock, self.pressure, reference):
            world.wait(lambda p=publisher: p.get_subscription_count() >= 2, "the recorder")
        world.wait(self.is_recorded, "recorded odometry and parameters")
        points = [reference_point(CIRCLE.at(time), time) for time in np.arange(0, 5, 0.05)]
        reference.publish(writing.reference(points, SECOND, "odom", "base_link"))

    def is_recorded(self):
        """Tell the first odometry once more, and look whether it is in the bag by now.

        And the controller's latched message, with which the recorder gets all others of it.
        """
        self.tell()
        recorded = {topic for topic, *_ in read_messages(self.world.directory / "bag")}
        return recorded >= {"/odom", f"/{NAME}/parameters"}

    def tell(self, frame="odom"):
        time = self.step * 0.005
        here, stamp = CIRCLE.at(time), SECOND + self.step * SECOND // 200
        state = State(here.pose + 0.01 * np.sin([3 * time, 5 * time, 7 * time]), here.velocity)
        self.odometry.publish(writing.odometry(state, stamp, frame, "base_link"))
        self.clock.publish(Clock(clock=writing.time(stamp)))
        return stamp

    def go(self, steps, frame="odom"):
        """Tell odometry, and wait for the answer, some times."""
        for _ in range(steps):
            seen, stamp = len(self.torques), writing.time(self.tell(frame))

            def is_answered(seen=seen, stamp=stamp):
                new = [message.header.stamp for message in self.torques[seen:]]
                return new if frame == "map" else stamp in new  # the bad one's is the last good one

            self.world.wait(is_answered, "answer")
            self.step += 1

    def set(self, name, value):
        double = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParameters.Request(parameters=[Parameter(name=name, value=double)])
        result = self.world.call(SetParameters, f"{NAME}/set_parameters", request)
        assert result.results[0].successful

    def enable(self, enabled):
        assert self.world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=enabled)).success


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    world = World(tmp_path_factory.mktemp("lockstep"))
    lockstep = Lockstep(world)
    lockstep.go(60)
    lockstep.set(GAIN, 3.0)
    lockstep.go(60)
    lockstep.pressure.publish(FluidPressure(fluid_pressure=2300.0))
    lockstep.go(60)
    said = len(lockstep.torques)
    lockstep.enable(False)
    world.wait(lambda: len(lockstep.torques) > said, "safe output for the same odometry")
    lockstep.go(20)
    lockstep.enable(True)
    lockstep.go(60)
    lockstep.go(5, frame="map")
    lockstep.go(60)
    assert world.end("record_bag") == 0
    world.close()
    return world.directory / "bag"


def copied(bag, copy, without="", storage="mcap", late=(), published=None, change=None):
    """Copy of a bag without a topic, or with messages of some that arrived 30 ms late.

    `published` takes the place of all times of publishing, `change` changes wheel torques.
    """
    with next(bag.glob("*.mcap")).open("rb") as file, BagWriter(copy, storage) as writer:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic == without:
                continue
            if channel.topic not in writer:
                writer.add_topic(channel.topic, schema.name, [])
            arrival = message.log_time + 30_000_000 * (channel.topic in late)
            at, data = message.publish_time if published is None else published, message.data
            if change and channel.topic == "/wheel_torques":
                sent = TYPESTORE.deserialize_cdr(data, schema.name)
                change(sent)
                data = bytes(TYPESTORE.serialize_cdr(sent, schema.name))
            writer.write(channel.topic, arrival, at, data)
    return copy


def test_whatever_happened_to_a_controller_happens_to_it_in_the_replay(bag, replay):
    numbers = replay(bag, *EXACT)
    assert numbers["answers"]["in both"] == numbers["answers"]["replayed"] == 320
    assert not numbers["changed"]
    for modes in numbers["modes"].values():
        happened = [mode for _, mode in modes if mode != "waiting for a reference"]
        assert happened[-5:] == ["following", "disabled", "following", "bad odometry", "following"]


@pytest.mark.parametrize("late", ["/odom", "/clock", "/reference", "/wheel_torques"])
def test_that_messages_came_late_to_the_recorder_changes_nothing(bag, tmp_path, replay, late):
    replay(copied(bag, tmp_path / "late", late=[late]), *EXACT)


def test_log_times_will_do_where_there_are_no_others(bag, tmp_path, replay):
    numbers = replay(copied(bag, tmp_path / "sqlite3", storage="sqlite3"))
    assert numbers["answers"]["in both"] == 320
    assert max(numbers["wheels"]["difference, RMS [N m]"]) < 0.01


def test_log_times_will_do_where_times_of_publishing_were_left_0(bag, tmp_path, replay, capsys):
    zeros = copied(bag, tmp_path / "zeros", published=0)
    numbers = replay(zeros)
    assert numbers["answers"]["in both"] == 320
    assert max(numbers["wheels"]["difference, RMS [N m]"]) < 0.01
    said = f"{zeros} does not tell when messages were published"
    assert capsys.readouterr().err.count(said) == 1


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_torques_are_taken_by_the_names_of_the_wheels(bag, tmp_path, replay, order):
    """In any order, beside what else has a torque, and without speeds, as in older bags."""

    def change(sent):
        names, efforts = list(sent.name), list(sent.effort)
        sent.name = ["left_brush", *(names[i] for i in order)]
        sent.effort = np.array([9.0, *(efforts[i] for i in order)])
        sent.velocity = np.array([])

    replay(copied(bag, tmp_path / "other", change=change), *EXACT)


def test_torques_of_wheels_with_other_names_are_refused(bag, tmp_path, replay):
    def change(sent):
        sent.name = ["wheel_l", "wheel_r"]

    other = copied(bag, tmp_path / "other", change=change)
    with pytest.raises(SystemExit, match="no right_wheel_joint and no left_wheel_joint among the"):
        replay(other)


def test_what_other_parameters_change_is_told_and_may_be_too_much(bag, replay, capsys, tmp_path):
    numbers = replay(bag, "-p", f"{GAIN}:=6.0")
    assert numbers["changed"] == {GAIN: [8.0, 6.0]}
    assert max(numbers["wheels"]["difference, largest [N m]"]) > 0.01
    assert f"{GAIN}: 8.0 recorded, 6.0 here" in capsys.readouterr().out
    rows = np.loadtxt(tmp_path / "replay" / "torques.csv", delimiter=",", skiprows=1)
    assert rows.shape == (320, 5)
    differences = np.sqrt(np.mean((rows[:, 3:] - rows[:, 1:3]) ** 2, axis=0))
    assert differences == pytest.approx(numbers["wheels"]["difference, RMS [N m]"])
    assert (tmp_path / "replay" / "torques.png").stat().st_size > 10_000
    with pytest.raises(SystemExit, match=r"differs by .* N m > 1e-09"):
        replay(bag, "-p", f"{GAIN}:=6.0", *EXACT)


def test_a_lower_limit_is_reached_more_often(bag, replay):
    checks = "stall_time", "response_time", "speed_margin", "yaw_rate_margin", "max_disturbance"
    unguarded = [word for check in checks for word in ("-p", f"guard.{check}:=0.0")]
    as_recorded, lower = (
        replay(bag, "-p", f"max_wheel_torque:={limit}", *unguarded)["wheels"]
        for limit in (20.0, 0.5)
    )
    reached = "replayed at the limit [%]"
    assert max(lower[reached]) > max(as_recorded[reached])
    # of what was recorded, what is beyond that limit counts
    assert max(lower["recorded at the limit [%]"]) > 0


@pytest.mark.parametrize("topic", ["odom", "reference", "wheel_torques", f"{NAME}/parameters"])
def test_a_topic_that_is_missing_is_named_in_one_line(bag, tmp_path, replay, topic):
    poor = copied(bag, tmp_path / "poor", without=f"/{topic}")
    with pytest.raises(SystemExit, match=f"^replay_controller: {poor} has no message on /{topic}"):
        replay(poor)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-p", "mas:=5.0"], r"mas is no parameter of the control law \(did you mean mass\?\)"),
        (["-p", "mass=5.0"], "'mass=5.0' must be name:=value"),
        (["-p", "mass:=-5.0"], r"mass=-5.0 must be > 0 \[kg\]"),
        (["-p", "observer.bandwidth:=[1]"], r"observer.bandwidth=\[1\] must be a finite number"),
        (["--params", "no.yaml"], "replay_controller: No such file .*no.yaml"),
        (["--namespace", "second"], "has no message on /second/wheel_torques"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(bag, replay, arguments, said):
    with pytest.raises(SystemExit, match=said) as error:
        replay(bag, *arguments)
    assert str(error.value).startswith("replay_controller: ")
    assert len(str(error.value).splitlines()) == 1
