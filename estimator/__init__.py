"""The torque estimator of Solomon and Hartmann (2008). Knows no image.

beam: C = 3EI. slip: moments of a known contact. distance: the contact of known moments, with uncertainty. curvature:
Appendix B and the thresholds of Figs 5 and 6. friction: α from moments. compliance: soft objects.
signal: touch and moments from samples. whisk, builtin: what an estimator is given and answers, and the paper's own;
sensors, load_cell, readings: other sensors of Table I. two_tilts: distance and α of several whisks together.
"""
