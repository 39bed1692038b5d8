"""What a path asks of a climber, told before anything drives.

`demands` computes what the reference asks for along the path, and how much of each limit is left;
`fastest` the highest rate at which enough is left;
`posterior` how probable it is that a climber falls or slips, by the intervals of a bag;
`check_path` is the executable, with `figure` the picture of it.
"""
