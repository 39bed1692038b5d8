"""Points of a reference, as a publisher of its own would make them."""

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
from trajectory_msgs.msg import MultiDOFJointTrajectoryPoint

from climber_uk.messages.writing import reference_numbers


def reference_point(reference, time):
    """Point of a trajectory message: a reference `time` [s] after the trajectory's start."""
    x, y, *rotation, v_x, v_y, v_yaw, a_x, a_y, a_yaw, sec, nanosec = reference_numbers(
        reference, time
    )
    quaternion = Quaternion(**dict(zip("xyzw", rotation, strict=True)))
    point = MultiDOFJointTrajectoryPoint()
    point.transforms = [Transform(translation=Vector3(x=x, y=y), rotation=quaternion)]
    point.velocities = [Twist(linear=Vector3(x=v_x, y=v_y), angular=Vector3(z=v_yaw))]
    point.accelerations = [Twist(linear=Vector3(x=a_x, y=a_y), angular=Vector3(z=a_yaw))]
    point.time_from_start = Duration(sec=int(sec), nanosec=int(nanosec))
    return point
