"""`analyze_bag`, `compare_bags`, `animate_bag`, `export_tum`: runs as numbers and pictures.

Bags -> runs (`bags.recorded_run`), each a `metrics.Case` -> `metrics` (with `trajectory_errors`) ->
a column of `tables` each -> at a glance (`cards`), text, CSV and JSON (`tables`), pictures
(`figures` and `grip`, by `plotting`), a page (`page`, `page_template`), and the exit status
(`condition`, `comparison`). `proportion` has the interval of a
probability. `reporting` calls these in turn for `analyze_bag` and `compare_bags`,
`outputs` says where they go; `animate_bag` draws a run as a film; `export_tum` writes poses as they
are, for other tools.
"""
