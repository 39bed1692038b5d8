"""Where the climber is on its wall, from encoders, an IMU and late fixes; pure numerics, no ROS.

Angles of the wheels -> `encoders` (how far they have rolled, and whether they rest); yaw rate and
specific force -> `imu` (between two samples of the encoders) -> `models.Travel` (`scrubbing`: of
wheels that slip in turns) and gravity -> `kalman` (predicted and corrected by the `models`, with
the variances of `options`) -> `history`, in which a fix corrects the state of its own stamp, and
all that came after it is done again. `gate` refuses fixes, until some agree; `doubts` tell what is
not known any more; `smoothing` lets the output go after the estimate without a jump,
`output_speed` makes its speed and yaw rate. `localizer.Localizer` calls these in their turn;
`sensor_frames` is how sensors are mounted. Of a recording, the `smoother` goes through all of it
backwards.
"""
