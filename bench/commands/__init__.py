"""The command line: one module for each verb, with its options and its run; cli.py lists them.

May import all of bench; nothing of bench imports it.
"""
