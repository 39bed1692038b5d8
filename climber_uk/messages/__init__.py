"""ROS messages to data and back: names, reading, writing, drawing, the layout of CDR."""
