"""Constraints and controller: state and reference in, wheel torques out; pure numerics, no ROS."""
