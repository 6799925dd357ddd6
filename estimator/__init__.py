"""The torque estimator of Solomon and Hartmann (2008), which knows no image.

From samples to a distance: onset finds first touch in the moments of a stroke, signal reads the moments
at the pushing angle, noise gives both their covariance; whisk holds what an estimator receives and
returns. builtin has the paper's estimators: the equation is in distance, its gradient, sigma and
interval in uncertainty, what (10) leaves out in first_order, and the whisker's taper in beam.

The paper's other equations: slip, the moments of a known contact; curvature and threshold, Appendix B
and the curves of Figs 5 and 6; friction, α from moments; compliance, soft objects.

Other estimators: exact_rod, of curved whiskers; sensors, load_cell, readings, profile, vibration,
microphone and contour, by other sensors of Table I; moving, both_ways, two_tilts and reorientation, by
more than one push at a standing object; seen_shape, by one camera.
"""
