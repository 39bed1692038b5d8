"""From a recorded bag to tables and figures."""
