"""From volts to moments: readings against seen deflections, the fit, its certificate, weights, reversal.

felt reads a stroke's touch, zero and channels, drift how far the zero wanders. gauge_readings pairs the volts
with moments that the seen deflection has by a rod (whisker_rods: clamped_rod where it is straight,
curved_rod elsewhere), and fit makes the coefficients of matrix of these pairs; gauge_faults refuses what
cannot be. certificate states them with reversal and weights, gauges_file keeps them.

May import base, session, cameras, records.
"""
