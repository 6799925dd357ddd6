"""One trial, one unit of work: what is seen, felt and estimated in it, and the placing by all of them.

May import base, session, cameras, records, gauges.
"""
