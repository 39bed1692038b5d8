"""`run_demo`: starts recorder and nodes, runs a trajectory for its duration, and ends them."""
