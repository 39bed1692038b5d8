"""`run_demo`: all nodes and a recorder, once.

A parameter file -> `run_demo`: processes of the nodes and of `record_bag`, and a node that looks on
until the trajectory ends -> a bag. `analyze_bag` takes it from there. Of the corners of an area
alone, `corners` makes such a file.
"""
