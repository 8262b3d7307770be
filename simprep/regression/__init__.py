"""Regression gate: did numbers move away from a baseline, by more than tolerances and chance allow?

`simprep check` and the pytest fixture `stability_regression` are its two front doors.
"""
