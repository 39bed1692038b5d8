"""`replay_controller`: the controller over a recorded bag."""
