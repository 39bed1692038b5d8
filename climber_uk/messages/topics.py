"""Names of the nodes and of their topics, relative to a climber's namespace; with / to none."""

PLANNER, CONTROLLER, PLANT = NODES = (
    "trajectory_publisher",
    "uk_torque_controller",
    "plant_simulator",
)
ODOMETRY, REFERENCE, TORQUES = "odom", "reference", "wheel_torques"
REFERENCE_TIME = "reference_time"  # where on the reference the climber was
REFERENCE_PATH = "reference_path"  # all of it, for display
GIVEN_PATH = "path"  # from a planner, or a person's clicks
FOLLOW_PATH = "follow_path"  # an action: the same, for who waits for what becomes of it
STICK = "cmd_vel"  # speeds: from a stick to the planner, or from the controller to a board
STICK_LOCK = "by_hand_lock"  # true: the planner ignores the stick
PROGRESS = f"{PLANNER}/progress"  # how far along its path a climber is
EVENTS = f"{PLANNER}/events"  # tags of its path that it reaches
TRUTH = "ground_truth"  # of a simulation, or of what watches from outside
JOINTS, PRESSURE, PUSH = "joint_states", "suction_pressure", "push"
SETPOINT = "suction_setpoint"  # of the pump
EMERGENCY_STOP, BATTERY = "emergency_stop", "battery_state"
IMU, POSE = "imu", "pose"  # of robots without an odometry of their own
LOCALIZATION = "wall_odometry"  # the node that makes one of them
PARAMETERS, FORCE = f"{CONTROLLER}/parameters", f"{CONTROLLER}/constraint_force"
MARGINS = f"{PLANT}/margins", f"{CONTROLLER}/margins"  # the plant knows better
CLOCK, DIAGNOSTICS, LOG = "/clock", "/diagnostics", "/rosout"
FELL = "fell off"  # what the plant reports of a climber that has, and then why


def private(topic: str) -> str:
    """A node's own topic, as the node itself names it."""
    return f"~/{topic.rpartition('/')[2]}"
