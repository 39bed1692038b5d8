"""What a program needs of its system: a command line, signals, and processes that end with it."""
