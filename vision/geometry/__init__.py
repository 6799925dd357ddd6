"""Space and lenses: cameras, board, rods, centrelines, silhouettes, contact; settings and refusals of vision.

Imports nothing else of vision.
"""
