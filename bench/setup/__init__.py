"""Before the first recording: a session to fill in, a board to print.

May import base, session, rig.
"""
