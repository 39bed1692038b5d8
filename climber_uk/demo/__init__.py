"""`run_demo`: all nodes and a recorder, once."""
