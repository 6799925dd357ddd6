"""From a session's board views to its calibrated cameras, and where the rig stands before them.

May import base, session.
"""
