"""Parameters: declared where they are used, read from files and nodes; no ROS."""
