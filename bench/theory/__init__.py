"""Figures from the paper's equations and from exact mechanics alone: Figs 5 and 6, maps of model error, design.

May import base and rig.
"""
