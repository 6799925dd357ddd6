"""ChArUco boards in pictures: corners with sigma, faults of a board, whether its views suffice.

May import geometry, pictures.
"""
