"""`replay_controller`, `localize`: the controller, or the filter of `wall_odometry`, over a bag.

A bag -> outputs of its controller (`recorded_controller`: torques, modes, parameters in force) and
its inputs in the order of publishing -> the nodes' `Controller` (`replay`) -> torques beside those
that were recorded (`torque_comparison`). `replay_controller` is the command line.

A bag -> its encoders, IMU and fixes (`recorded_sensors`) -> the filter forwards and backwards, and
numbers of both (`localized`) -> `localization_figure`; `localize` is the command line.
"""
