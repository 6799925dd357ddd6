"""The questions that are put to all whisks of a session together: one module an analysis, all of them in `catalogue`.

May import base, session, cameras, records, gauges, trials.
"""
