"""From odometry and reference to wheel torques; pure numerics, no ROS.

`build` makes it all as parameters say: a `controller.Controller` (whether to follow: `safety`,
`guard`, `ages`, `twist_check`) with an `active_reference` (what to follow: `approach`,
`time_scaling`) and a `sampled_controller` (where the climber is when a torque acts: `model`,
`torque_history`, `twist`, `latency`), which has a `control_law` (which torque) with one of the
`constraints` (which acceleration: `guidance`, `exact`, as `constraint_set` says).
docs/architecture.md follows one odometry through it.
"""
