"""Whole jobs on a session, which the verbs run: check, evaluate, calibrate the gauges, compare
settings.

May import all of bench but `commands`; `commands` and `bench/api.py` are made of it.
"""
