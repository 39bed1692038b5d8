"""What the filter is told of sensors and wall: deviations, limits, and where it starts."""

import math
from functools import cached_property

from climber_uk.mechanics.climber import DEGREE, GRAVITY
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class LocalizationOptions:
    """Climber and wall, how good the sensors are, and what is known at the start."""

    wheel_radius: float = parameter(0.027, "m", "wheel radius r", above=0, plausible=(0.005, 0.5))
    half_track: float = parameter(
        0.3, "m", "distance d of a wheel from the centre", above=0, plausible=(0.02, 2)
    )
    effective_half_track: float = parameter(
        0.0,
        "m",
        "half track by which wheels reckon turns, wider where they scrub; 0: half_track",
        at_least=0,
        plausible=(0.02, 3),
    )
    inclination: float = parameter(
        90.0,
        "deg",
        "inclination of the wall: 0 floor, 90 vertical, 180 ceiling",
        at_least=0,
        at_most=180,
    )
    gyro_noise: float = parameter(
        0.002,
        "rad/√s",
        "noise of the gyro: deviation of the yaw rate's integral after a second",
        above=0,
    )
    gyro_bias_deviation: float = parameter(
        0.02, "rad/s", "standard deviation of the gyro's bias at the start", at_least=0
    )
    gyro_bias_walk: float = parameter(
        1e-4, "rad/s/√s", "how much the gyro's bias wanders", at_least=0
    )
    acceleration_noise: float = parameter(
        0.005,
        "m/s/√s",
        "noise of the accelerometer: deviation of the specific force's integral after a second",
        above=0,
    )
    imu_x: float = parameter(0.0, "m", "place of the IMU in base_frame: forwards of the centre")
    imu_y: float = parameter(0.0, "m", "place of the IMU in base_frame: to the left of the centre")
    acceleration_bias_deviation: float = parameter(
        0.1,
        "m/s²",
        "standard deviation of either bias of the accelerometer at the start; 0: there is none",
        at_least=0,
    )
    acceleration_bias_walk: float = parameter(
        0.0002, "m/s²/√s", "how much the accelerometer's biases wander", at_least=0
    )
    scale_deviation: float = parameter(
        0.01,
        "",
        "standard deviation of the scale error σ of the encoders' distance: slip, and a wrong"
        " wheel radius",
        at_least=0,
    )
    scale_time: float = parameter(
        10.0, "s", "time in which the scale error σ of the encoders changes", above=0
    )
    creep_deviation: float = parameter(
        0.03,
        "",
        "standard deviation of creep: what the climber sags on a vertical wall, by the way rolled",
        at_least=0,
    )
    scrub_deviation: float = parameter(
        0.0,
        "m",
        "standard deviation of how far wheels that scrub give way by an angle: λ, and a, by "
        "the same share of both if they are told; 0: they do not scrub",
        at_least=0,
        plausible=(0.0, 1.0),
    )
    slip_deviation: float = parameter(
        0.5,
        "",
        "standard deviation of how far wheels that scrub slip along, by what their sides slip"
        " in turns (ζ, ξ)",
        at_least=0,
    )
    slip_walk: float = parameter(
        0.05,
        "1/√rad",
        "how much the slip along (ζ, ξ) of wheels that scrub wanders in a turn",
        at_least=0,
    )
    way_noise: float = parameter(
        0.001, "m/√m", "deviation of the position after a metre, else unexplained", at_least=0
    )
    turn_noise: float = parameter(
        0.01,
        "rad/√rad",
        "noise of a turn by encoders, beside their scale, used without an IMU; 0.05 if wheels"
        " scrub",
        at_least=0,
    )
    initial_x: float = parameter(0.0, "m", "x of the climber at the start")
    initial_y: float = parameter(0.0, "m", "y of the climber at the start")
    initial_creep: float = parameter(
        0.0,
        "",
        "creep at the start, as `localize` has told of an earlier run",
        at_least=-1,
        at_most=1,
    )
    initial_scrub: float = parameter(
        0.0, "m", "λ at the start: sag to a side by the angle turned, as `localize` has told"
    )
    initial_pivot: float = parameter(
        0.0,
        "m",
        "a at the start: how far below the centre the climber turns, as `localize` has told",
    )
    initial_drag_slip: float = parameter(
        0.0, "", "ζ at the start: slip along by what drags the climber, as `localize` has told"
    )
    initial_weight_slip: float = parameter(
        0.0, "", "ξ at the start: slip along by the weight, as `localize` has told"
    )
    initial_heading: float = parameter(0.0, "rad", "heading of the climber at the start")
    initial_position_deviation: float = parameter(
        0.01,
        "m",
        "standard deviation of initial_x and initial_y; above initial_position_limit: a fix "
        "is waited for",
        above=0,
    )
    initial_heading_deviation: float = parameter(
        math.pi,
        "rad",
        "standard deviation of initial_heading; above initial_heading_limit: gravity or a fix"
        " tells",
        above=0,
    )
    initial_position_limit: float = parameter(
        0.2,
        "m",
        "deviation of the position above which nothing is published at the start, and which "
        "is reported later",
        above=0,
    )
    initial_heading_limit: float = parameter(
        0.1,
        "rad",
        "deviation of the heading above which nothing is published at the start, and which is"
        " reported later",
        above=0,
    )
    gate_probability: float = parameter(
        0.999, "", "share of good fixes that pass the gate", above=0, at_most=0.999999
    )
    agreeing_fixes: int = parameter(
        5, "", "number of fixes refused in a row that are believed if they agree", at_least=2
    )
    longest_delay: float = parameter(
        1.0, "s", "age of a fix above which it is refused", above=0, plausible=(0.05, 10)
    )
    pull_time: float = parameter(0.3, "s", "time in which the output follows a correction", above=0)
    pull_speed: float = parameter(
        0.05, "m/s", "fastest speed at which the output follows a correction", above=0
    )
    pull_yaw_rate: float = parameter(
        0.1, "rad/s", "fastest turn at which the output follows a correction", above=0
    )

    output_frequency: float = parameter(
        100.0, "rad/s", "bandwidth W of the output's speeds: lower is smoother, and later", above=0
    )

    @cached_property
    def scrubs(self) -> bool:
        """Whether wheels scrub in turns."""
        return self.scrub_deviation > 0 or self.initial_scrub != 0

    @cached_property
    def turning_lever(self) -> float:
        """Half track of the wheels' turns [m]."""
        return self.effective_half_track or self.half_track

    @cached_property
    def gravity_along_wall(self) -> float:
        """g_t = g sin(inclination) [m/s²]."""
        return GRAVITY * math.sin(self.inclination * DEGREE)
