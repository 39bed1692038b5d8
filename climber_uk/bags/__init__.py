"""Bags: opened, repaired, decoded, and read into runs; written.

From a bag to runs: files, whatever they are and however damaged (`bag_files`; `mcap_file` with
`mcap_contents` and `mcap_records`, `sqlite_file` with `sqlite_database`; `connection` is what they
have in common, `unpacking` keeps within bounds) -> one open bag (`bag.open_bag`, `definitions`) ->
its messages decoded in batches (`batches`) -> arrays by topic (`topics`, `extraction`, `joints`,
`reference`, `events`, gathered by `collecting`) -> one climber's runs (`restarts`, `run_reader`,
`time_series`, `body_rates`) -> `run.RecordedRun`. All of it in one call: `recorded_run.read_runs`.
One message after the other, as they were published: `publishing_order`.

To a bag: messages -> `log_clock` -> `bag_writer` -> `storage`.
"""
