"""Controller and simulated robot in one process: one, or thousands at once.

One: a trajectory -> `simulate.simulate` (the nodes' `Controller` and `SimulatedRobot`, and a `Link`
of delay, jitter, loss and noise between them) -> `simulate.Run`.

Many: arrays (N,) in the place of numbers -> `batch.Loops` (the nodes' `Estimator`, with
`pressure_gauge` and `simulation.sensors`) -> `period.LoopsState`, from one period to the next ->
steps of the plants (`unicycle`, or `compiled`, which is the same by numba) -> `outcome.Tally` ->
`outcome.Outcome`. By JAX (`traced`) all of it but the first periods.

`node_parameters` has the parameters of controller, plant and planner, and reads files of them;
`start` tells of a simulated climber that does not start where its path begins, or is other than
its controller has it.
"""
