"""Parameters: declared where they are used, read from files and nodes; no ROS.

A dataclass with fields made by `declaration.parameter` says default, unit, bounds and meaning once:
for the node (`ros.parameters`), for a tool without ROS (`parameter_file.Values`), for docs and
campaigns. `parameter_files` and `parameter_paths` find what a node's files have for it, `text_file`
keeps what is read within bounds, `changed_parameters` writes a file anew, `plausibility` doubts
numbers in another unit. `registry` has the variants that a name chooses among, those of other
packages included.
"""
