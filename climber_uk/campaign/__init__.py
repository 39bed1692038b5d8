"""`campaign`: the share of runs that fall, with parameters, starts and noise drawn at random.

A campaign's file -> `campaign.read` (`names`, `distributions`, `limits`; all is checked before
anything runs) -> parts of runs (`running`, in processes) -> each part's draws as closed loops
(`parts`, `scenario`, `closed_loop.batch`) -> Parquet files (`parts.Store`) -> table (`results`,
`counting`) and pictures (`figures`). One run again, through the nodes: `rerun`. `command` is the
command line.
"""
