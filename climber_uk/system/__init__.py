"""What a program needs of its system: a command line, signals, and processes that end with it.

`command_line` for every tool, and `streams` that were closed before; `signals`, `processes` and
`workers` for what starts others; `exits` for what a library must not hold up.
"""
