"""The torque estimator of Solomon and Hartmann (2008). Knows no image."""
