"""What a program needs of its system: a command line, and processes that end together."""
