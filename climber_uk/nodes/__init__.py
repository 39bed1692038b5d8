"""The ROS 2 nodes: declare, subscribe, publish."""
