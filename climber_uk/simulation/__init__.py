"""The simulated climber: state and torques in, state out; pure numerics, no ROS."""
