"""The executables that are nodes: declare, subscribe, publish. What they share is in `ros`.

`trajectory_publisher` -> reference -> `uk_torque_controller` -> wheel_torques -> `plant_simulator`
-> odom, for both of them; `markers` draws it. Where a robot has no odometry, `wall_odometry` makes
it, of joint_states, imu and pose.
"""
