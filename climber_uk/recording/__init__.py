"""`record_bag`: subscribes topics and writes what arrives into a rosbag2 directory."""
