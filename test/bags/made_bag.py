"""Bags of runs that are known in closed form, written message by message."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from climber_uk.bags.bag_writer import BagWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
SECOND = 10**9
START = 5 * SECOND  # [ns] stamp of the first odometry
BEGAN = 1_700_000_000 * SECOND  # [ns] log time of the same
RADIUS, RATE = 2.0, 0.5  # of the circle that the reference goes round [m], [rad/s]

ODOMETRY, JOINTS = "nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState"
REFERENCE = "trajectory_msgs/msg/MultiDOFJointTrajectory"
WRENCH, VECTOR = "geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/Vector3Stamped"


def blank(type_name):
    """A message with nothing but zeros."""

    def value(description):
        kind, what = description
        if kind == Nodetype.NAME:
            return blank(what)
        if kind == Nodetype.BASE:
            return "" if what[0] == "string" else 0.0 if "float" in what[0] else 0
        element, length = what
        if element[0] == Nodetype.NAME or element[1][0] == "string":
            return [value(element) for _ in range(length)]
        return np.zeros(length, {"byte": "u1"}.get(element[1][0], element[1][0]))

    fields = STORE.fielddefs[type_name][1]
    return STORE.types[type_name](**{name: value(of) for name, of in fields})


def message(type_name, stamp=None, frame="odom", **values):
    """A message with some values, by paths with __ for a dot."""
    made = blank(type_name)
    if stamp is not None:
        made.header.stamp.sec, made.header.stamp.nanosec = divmod(int(stamp), SECOND)
        made.header.frame_id = frame
    for path, value in values.items():
        *above, last = path.split("__")
        inner = made
        for name in above:
            inner = getattr(inner, name)
        setattr(inner, last, value)
    return made


def turn(heading):
    zero = 0.0
    half = float(heading) / 2
    return STORE.types["geometry_msgs/msg/Quaternion"](zero, zero, np.sin(half), np.cos(half))


def on_circle(time):
    """Pose (n, 3), velocity and acceleration of the reference at times (n,) [s]."""
    s = RATE * np.asarray(time)
    pose = np.stack([RADIUS * np.cos(s), RADIUS * np.sin(s), s + np.pi / 2], axis=-1)
    velocity = RATE * np.stack([-pose[..., 1], pose[..., 0], 1 + 0 * s], axis=-1)
    acceleration = -(RATE**2) * np.stack([pose[..., 0], pose[..., 1], 0 * s], axis=-1)
    return pose, velocity, acceleration


@dataclass
class Made:
    """A run of n odometry messages, with fixed errors along, across and in heading."""

    n: int = 400
    period: float = 0.005  # [s]
    errors: Callable = lambda time: np.zeros((len(time), 3))
    torques: Callable = lambda time, pose: np.ones((len(time), 2))  # right, left
    namespace: str = ""
    speed: float = RADIUS * RATE
    messages: list = field(default_factory=list)  # topic, type, log time and message

    def __post_init__(self):
        self.time = self.period * np.arange(self.n)
        self.stamps = START + np.round(self.time * SECOND).astype(np.int64)
        along, across, turned = self.errors(self.time).T
        reference, _, _ = on_circle(self.time)
        cosine, sine = np.cos(reference[:, 2]), np.sin(reference[:, 2])
        offset = along * cosine - across * sine, along * sine + across * cosine, turned
        self.pose = reference + np.stack(offset, axis=1)

    def add(self, topic, type_name, log_time, made):
        full = topic if topic.startswith("/") else f"{self.namespace}/{topic}"
        self.messages.append((full, type_name, int(log_time), made))

    def arrival(self, stamp):
        return BEGAN + int(stamp) - START

    def add_odometry(self, chosen=None):
        for i in range(self.n) if chosen is None else chosen:
            made = message(
                ODOMETRY,
                self.stamps[i],
                child_frame_id="base_link",
                pose__pose__position__x=float(self.pose[i, 0]),
                pose__pose__position__y=float(self.pose[i, 1]),
                pose__pose__orientation=turn(self.pose[i, 2]),
                twist__twist__linear__x=self.speed,
                twist__twist__angular__z=RATE,
            )
            self.add("odom", ODOMETRY, self.arrival(self.stamps[i]), made)

    def add_reference(self, begin=0.0, end=None, every=0.1):
        """Previews of a second, of which each point comes 20 times."""
        end = self.time[-1] if end is None else end
        for start in np.arange(begin, end + every / 2, every):
            made = message(REFERENCE, START + round(start * SECOND))
            made.joint_names = ["base_link"]
            for after in np.arange(21) * 0.05:
                made.points.append(self.point(start, after))
            self.add("reference", REFERENCE, self.arrival(START + round(start * SECOND)), made)

    def point(self, start, after):
        pose, velocity, acceleration = (v.tolist() for v in on_circle(start + after))
        point = blank("trajectory_msgs/msg/MultiDOFJointTrajectoryPoint")
        point.time_from_start.nanosec = round(after * SECOND) % SECOND
        point.time_from_start.sec = round(after * SECOND) // SECOND
        at = blank("geometry_msgs/msg/Transform")
        at.translation.x, at.translation.y = pose[:2]
        at.rotation = turn(pose[2])
        point.transforms = [at]
        for name, (x, y, z) in (("velocities", velocity), ("accelerations", acceleration)):
            twist = blank("geometry_msgs/msg/Twist")
            twist.linear.x, twist.linear.y, twist.angular.z = x, y, z
            setattr(point, name, [twist])
        return point

    def add_torques(self, chosen=None, latency=lambda i: 1_000_000):
        torques = np.ascontiguousarray(self.torques(self.time, self.pose)[:, ::-1])
        for i in range(self.n) if chosen is None else chosen:
            made = message(JOINTS, self.stamps[i], name=["left", "right"], effort=torques[i])
            self.add("wheel_torques", JOINTS, self.arrival(self.stamps[i]) + latency(i), made)

    def add_joints(self, rates, torques):
        names = "left_wheel_joint", "right_wheel_joint"
        self.add_joint_states(names, rates[::-1], torques[::-1])

    def add_joint_states(self, names, rates, torques, later=0, topic="joint_states"):
        """Of joints by their names, each message some ns later than the odometry."""
        for stamp in self.stamps + later:
            made = message(
                JOINTS,
                stamp,
                name=list(names),
                position=np.zeros(len(names)),
                velocity=np.array(rates, float),
                effort=np.array(torques, float),
            )
            self.add(topic, JOINTS, self.arrival(stamp), made)

    def add_parameters(self, time=0.0, **values):
        """What the controller tells of its parameters at some time."""
        event = blank("rcl_interfaces/msg/ParameterEvent")
        kinds = {bool: (1, "bool"), int: (2, "integer"), float: (3, "double"), str: (4, "string")}
        for name, value in values.items():
            number, kind = kinds[type(value)]
            told = blank("rcl_interfaces/msg/Parameter")
            told.name, told.value.type = name, number
            setattr(told.value, f"{kind}_value", value)
            event.new_parameters.append(told)
        at = BEGAN + round(time * SECOND)
        topic = "uk_torque_controller/parameters"
        self.add(topic, "rcl_interfaces/msg/ParameterEvent", at, event)

    def add_truth(self, pose, frame="odom"):
        for stamp, (x, y, heading) in zip(self.stamps, pose.tolist(), strict=True):
            made = message(ODOMETRY, stamp, frame, pose__pose__orientation=turn(heading))
            made.pose.pose.position.x, made.pose.pose.position.y = x, y
            self.add("ground_truth", ODOMETRY, self.arrival(stamp), made)

    def edit(self, topic, change):
        """Change the messages of a topic, each in its place."""
        for full, _, _, made in self.messages:
            if full == f"{self.namespace}/{topic}":
                change(made)

    def add_vectors(self, topic, values):
        for stamp, (x, y, z) in zip(self.stamps, values, strict=False):
            made = message(VECTOR, stamp, vector__x=x, vector__y=y, vector__z=z)
            self.add(topic, VECTOR, self.arrival(stamp), made)

    def add_reference_time(self, position, every=0.05):
        """Where on the reference the climber was: `position` [s] of a time [s]."""
        kind = "sensor_msgs/msg/TimeReference"
        for time in np.arange(0.0, self.time[-1] + every, every):
            stamp, at = (START + round(t * SECOND) for t in (time, position(time)))
            made = message(kind, stamp, time_ref__sec=at // SECOND, time_ref__nanosec=at % SECOND)
            self.add("reference_time", kind, self.arrival(stamp), made)

    def add_forces(self, values):
        for stamp, (x, y, z) in zip(self.stamps, values, strict=True):
            made = message(
                WRENCH, stamp, wrench__force__x=x, wrench__force__y=y, wrench__torque__z=z
            )
            topic = "uk_torque_controller/constraint_force"
            self.add(topic, WRENCH, self.arrival(stamp), made)

    def add_mode(self, time, mode, level=0):
        made = message("diagnostic_msgs/msg/DiagnosticArray", START + round(time * SECOND))
        status = blank("diagnostic_msgs/msg/DiagnosticStatus")
        status.level, status.message = level, mode if level else "ok"
        status.name = f"{self.namespace}/uk_torque_controller"
        status.values = [STORE.types["diagnostic_msgs/msg/KeyValue"]("mode", mode)]
        made.status = [status]
        arrival = self.arrival(START + round(time * SECOND))
        self.add("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", arrival, made)

    def add_log(self, time, level, text):
        made = blank("rcl_interfaces/msg/Log")
        made.level, made.name, made.msg = level, "uk_torque_controller", text
        self.add("/rosout", "rcl_interfaces/msg/Log", BEGAN + round(time * SECOND), made)

    def write(self, path, storage="mcap", flush=False):
        return write(path, self.messages, storage, flush)


def write(path, messages, storage="mcap", flush=False, topics=()):
    """A bag of topics, types, log times and messages, and of other topics without messages."""
    with BagWriter(path, storage) as writer:
        for topic, type_name in dict(topics).items():
            writer.add_topic(topic, type_name, [])
        for topic, type_name, log_time, made in sorted(messages, key=lambda message: message[2]):
            if topic not in writer:
                writer.add_topic(topic, type_name, [])
            data = bytes(STORE.serialize_cdr(made, type_name))
            writer.write(topic, log_time, log_time, data)
            if flush:
                writer.flush()
    return path


def a_run(n=60, **how):
    """A run with odometry, reference and torques."""
    made = Made(n, **how)
    made.add_odometry()
    made.add_reference()
    made.add_torques()
    return made
