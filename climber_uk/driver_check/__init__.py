"""What can be told of a driver by listening to its odometry, and by small torques."""
