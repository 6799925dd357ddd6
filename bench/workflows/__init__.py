"""Whole jobs on a session, which the verbs run: check, evaluate, calibrate the gauges, compare
settings.

May import all of bench but `commands` and `bench/api.py`, which are made of it.
"""
