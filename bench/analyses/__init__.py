"""What many whisks tell of friction: surfaces, fitted angles, section VII, the error explained and mapped.

May import base, session, cameras, gauges, trials.
"""
