"""One reprojection fit a whisk: parameters, residuals, covariance, touch, and whether the wire is a beam.

May import geometry, pictures, wire, touched.
"""
