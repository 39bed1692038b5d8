"""The ROS side that nodes share: start and end, topics, parameters, diagnostics, managed life."""
