"""Parameters: their declaration, their files, and doubts about their values; no ROS."""
