"""Thresholds at which a driver passes or fails a check, each with its reason.

What a busy computer can spoil is judged by medians, so that it fails no driver.
"""

# Time
SLOWEST, FASTEST = 20.0, 1000.0  # [Hz] of odometry: beyond, the controller was never tried
RATE_OFF = 1.25  # times `control_period`, which the controller takes for the first few messages
UNEVEN, VERY_UNEVEN = 0.1, 0.5  # typical error of a step of the stamps, in steps
OLD = 0.5  # of `odometry_timeout`, at which the controller refuses an odometry
AHEAD = 0.02  # [s] of the clock: two computers synchronised by NTP, or a tick of /clock
NEAREST_CLOCK = 10.0  # [s] from a clock that may be meant by a stamp; clocks are further apart
FEWEST = 5  # messages of which a statistic is made
# [s] of an unconfigured delay: half of what the controller bears, docs/control.md; its timeout
REACTION, LATE_REACTION = 0.01, 0.1
SERVO_REACTION = 0.03  # [s] of a speed servo, which has to overcome friction first

# Motion
MOVED, TURNED = 0.005, 0.01  # [m], [rad] of a motion that is long enough to judge
BLOCK = 0.05  # [s] over which speed and displacement are compared: steps are noise
RATIO_OFF, RATIO_WRONG = 0.1, 0.25  # of pose and twist: rounding and noise; a wrong unit or radius
GAP = 4.0  # periods from which on messages, and their twist, are lost
TELLING = 0.2  # of a block's largest displacement: smaller ones are mostly noise
STRAIGHT = 0.3  # of the way: less of the rims' turn is still straight on
NO_TWIST = 5e-4  # of the pose's displacement: less than a speed in km/s would be
UNIT_OFF = 0.2  # by which a wrong unit may be missed, of 57.3
SAME_FRAME = 0.05  # of the way: too small a difference between the frames of body and wall
SLIP, MUCH_SLIP = 0.02, 0.1  # sideways, of the speed: noise; a wheel that slides or is misaligned

# Reaction to torques
STANDING_SPEED, STANDING_RATE = 0.02, 0.05  # [m/s], [rad/s] that still are rest
NOISES = 5.0  # standard deviations at rest that are no motion
MOVING = 0.2  # of the highest speed: where friction surely slides
LIKENESS = 0.9  # cosine of a reaction and the one it is taken for
# times the model's: the controller learns the first, docs/control.md
GAIN_OFF, GAIN_WRONG = 1.2, 1.5
# times what is told: what the controller learns, docs/control.md; [s] that are near in any case
SERVO_OFF, SERVO_NEAR = 2.0, 0.01
TRACK_OFF = 1.5  # times the half track: four wheels as long as wide scrub about as much
STILL_PUSHED = 0.5  # of the acceleration that a torque gave while it was commanded
LONGEST_DELAY = 0.2  # [s] that is looked for

# IMU and fixes
NO_GRAVITY = 5.0  # [m/s²]: less is motion, or g
TILTED = 5.0, 15.0  # [°]: biases of cheap accelerometers and a rough heading; another axis
TURNED_ENOUGH = 0.05  # [rad] by which the scale of a gyro shows
FIXED_WAY = 0.1  # [m] by which the axes of fixes show; more where they are rough
MIRRORED = 0.5  # of the misfit that is left if the way is mirrored
SENSOR_LATE, SENSOR_AHEAD = 1.0, 0.1  # [s]: `longest_delay`; two clocks that are set
