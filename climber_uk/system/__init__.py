"""Command lines, signals, and child processes that end with their parent."""
