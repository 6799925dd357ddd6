"""Rods in a picture: bands of pixels along a predicted curve, shading, and line points with sigma.

May import geometry and pictures; calibration and boards are not needed here.
"""
