"""`identify`: parameters of a climber from a recorded motion."""
