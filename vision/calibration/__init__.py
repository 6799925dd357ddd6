"""Cameras from board views: one adjustment with covariance, held-out checks, files, and where the
rig is.

May import geometry, pictures, boards.
"""
