"""`check_driver`: is a driver fit? By listening to its odometry and, if allowed, by small torques.

Messages -> `node` (`graph`: publishers and subscriptions) -> `evidence`; with `--move` a `trial` of
`pulses` answers odometry and adds to it -> `checks` of all that was seen (`listening`, `timing`,
`moving`, `sensing`, and `reacting` by the `response`; by the `thresholds`) -> `report`.
`check_driver` is the command line, and writes the parameters that were found.
"""
