"""The synthetic rig: records sessions with known truth. Its physics is not the estimator's."""
