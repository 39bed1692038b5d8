"""`record_bag`: topics into a rosbag2 directory."""
