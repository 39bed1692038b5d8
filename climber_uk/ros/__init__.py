"""What the nodes share: how they start, talk, take parameters and end.

`running` (the base class, and `run`), `output` (topics as bytes), `parameters`, `managed` (a
lifecycle), `leaving`, `margins`, `suction_setpoint` and `transport`; for the planner `path_intake`
(paths from outside), `path_goals` (of an action) and `stick`; for the plant `plant_parts` (from
parameters), `plant_time` (lock-step) and `plant_topics`.
"""
