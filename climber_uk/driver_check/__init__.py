"""`check_driver`: a driver judged by its odometry, and by its reaction to small torques.

The node (`node`) collects odometry and answers it with the pulses of a trial (`trial`, `pulses`);
what was seen (`evidence`, `graph`) is judged check by check (`checks`), and printed (`report`).
"""
