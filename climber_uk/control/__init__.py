"""From odometry and reference to wheel torques; pure numerics, no ROS.

`build` makes it all as parameters say: a `controller.Controller`, through which an odometry goes
from top to bottom. What it tells: `estimator` (by the `model`; `timing`: when torques act;
`delay_check`: is that when they are told to? `side_slip`: wheels that give way), as `observed`.
Whether that can be, and whether to follow: `twist`, `guard` (`actuator_check`: do wheels answer?
`encoder_check`: do wheels turn as odometry says? `repeat_check`: is it news? `force_budget`: what
is given while no motion is told), `safety`, `stops`, else the `safe_output`, which brakes by
`polarity`. Where to: `active_reference` (`approach`, `time_scaling`). Which torques: `control_law`,
with one of the `constraints` (which acceleration: `guidance`, `exact`, as `constraint_set` says);
and which speeds of motors that take these, `speed_command`. How little suction will do for it:
`least_suction`.
docs/architecture.md follows one odometry through it.
"""
