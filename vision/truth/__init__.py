"""A trial's pictures in, its truth out: `observe.observe_trial` is the only door that bench uses.

May import all of vision but calibration's commands.
"""
