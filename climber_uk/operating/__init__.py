"""The command `climber`, for people without ros2cli: `command`, by the services of the nodes.

`watching` is what it shows of a climber that drives.
"""
