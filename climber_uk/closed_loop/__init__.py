"""Controller and simulated robot in one process: one, or thousands at once."""
