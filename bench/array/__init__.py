"""Several whiskers of one session: each is evaluated as a run of its own, and here they are put together.

May import report and all before it.
"""
