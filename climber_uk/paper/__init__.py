"""`reproduce_paper`: Xu & Liu (2017) recomputed: as printed, made consistent, and compared.

The equations (`printed`, `consistent`) -> twenty seconds of motion by several integrators
(`motion`), what the paper's errors may come from (`attempts`), 1000 s (`drift`), and the nodes'
closed loop (`closed_loop`), as jobs of `study` -> `table` and `figures`. `reproduce_paper` is the
command line.
"""
