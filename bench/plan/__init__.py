"""A bench planned before it is built: what sigma each trial's truth would have, what limits it, which one change would
help most; and the same for a session as recorded. The lines of wire and bar are predicted, the fit and its covariance
are those of `vision`. It knows session, rig, records and trials.
"""
