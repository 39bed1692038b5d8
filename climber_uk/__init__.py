"""Udwadia-Kalaba torque control of a wheeled wall-climbing robot."""
