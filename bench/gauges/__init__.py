"""From volts to moments: readings against seen deflections, the fit, its certificate, weights, reversal.

May import base, session, cameras, records.
"""
