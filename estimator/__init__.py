"""The torque estimator of Solomon and Hartmann (2008), which knows no image.

beam: C = 3EI. slip: moments of a known contact. distance: contact of known moments, with uncertainty.
curvature, threshold: Appendix B and the thresholds of Figs 5 and 6. friction: α from moments.
compliance: soft objects. signal: touch and moments from samples. whisk: what an estimator receives
and returns. builtin: the paper's own estimators. sensors, load_cell, readings: other sensors of
Table I. two_tilts: distance and α of several whisks together.
"""
