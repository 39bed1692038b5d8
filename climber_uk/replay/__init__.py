"""`replay_controller`: the controller over a recorded bag.

A bag -> outputs of its controller (`recorded_controller`: torques, modes, parameters in force) and
its inputs in the order of publishing -> the nodes' `Controller` (`replay`) -> torques beside those
that were recorded (`torque_comparison`). `replay_controller` is the command line.
"""
