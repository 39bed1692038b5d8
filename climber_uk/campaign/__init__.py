"""`campaign`: many closed loops with parameters, starts, noise and faults drawn at random.

A file (`campaign`) has what is drawn (`distributions`) and the `limits`; parts of the runs are
computed (`scenario`, `running`) and kept (`parts`), and counted (`counting`, `results`, `figures`).
"""
