"""`identify`: parameters of a climber from a recorded motion.

A bag -> arrays (`recorded_motion`, smoothed by `even_time`) and what it was driven on
(`recorded_site`) -> the equations of motion in integral form, window by window
(`integral_equations`) -> a robust fit (`window_fit`), with the torques' `lateness` by search ->
`coefficients` as parameters with intervals (`estimation` calls these in turn) -> what the equations
lack (`fit_test`) and what is not determined, and why (`verdict`) -> `identified.Identified` ->
`report`, `figure`, a parameter file. `identify` is the command line; `excitation` plans a
trajectory that shows more.
"""
