"""`record_bag`: topics into a rosbag2 directory.

The graph -> subscriptions that fit every publisher (`offered_qos`) -> messages as bytes, unread
(`record_bag`) -> `bags.bag_writer`.
"""
