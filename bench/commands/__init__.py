"""The verbs: one module each, on the command line and for Python.

May import all of bench; nothing of bench imports it.
"""
