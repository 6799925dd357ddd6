"""Grey pictures: files and videos in order, one camera's view of a whisk, pixel noise, changes.

May import geometry.
"""
