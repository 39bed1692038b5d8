"""What becomes of a trajectory under way: pure numerics, no ROS.

A `course` is a trajectory that was begun: its points ahead of the climber, by a `path_clock` that
pauses, goes on, slower or backwards; `progress` tells how far it is, `events` which tags it has
reached. A `given_path` comes from outside, as a `goal` if somebody waits for it; a stick drives
`by_hand`; a `journey` has one of them under way, and what comes next.
"""
