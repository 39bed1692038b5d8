"""The simulated climber: state and torques in, state out; pure numerics, no ROS.

A commanded torque (`command_buffer`) -> `simulated_robot`: pump -> `motors` -> `plant` -> `sensors`
-> odometry. The plant takes a step by `rigid_body` (forces, and smooth motion), `rolling` (the seal
sticks and slides) or `sliding` with `cones` (wheels slip, too); `inputs` is what acts in it.
`options` says how a simulation runs. `field_sensors` is what a robot without odometry measures.
"""
