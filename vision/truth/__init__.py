"""A trial's pictures in, its truth out: `observe.observe_trial`.

A whisk that is known exactly has the truth that it would give predicted by `predicted_truth.predict_truth`. May import all
folders of vision.
"""
