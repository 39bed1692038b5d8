"""What a path asks of a climber, told before anything drives.

`demands` computes what the reference asks for along the path, and how much of each limit is left;
`fastest` the highest rate at which enough is left, and the files by which nodes drive the fastest
law, which `time_optimal` finds, within `path_limits`;
`posterior` how probable it is that a climber falls or slips, by the intervals of a bag;
`check_path` is the executable, with `findings` in words and `figure` the picture of it.
"""
