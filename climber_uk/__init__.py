"""Udwadia-Kalaba torque control of a wheeled wall-climbing robot.

In docstrings and comments "(n)" is an equation of Xu & Liu (2017), and "§n" a section: both stand
in docs/theory.md, which has the symbols, too.
"""
