"""What a trial's result holds, as typed records, and how they stand in JSON.

May import base, session, cameras.
"""
