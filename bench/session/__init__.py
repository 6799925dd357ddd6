"""A recorded session on disk, read strictly: manifests, signals, frame times, strokes, and `check`.

May import base.
"""
