"""ChArUco boards in pictures: corners with sigma, what is wrong with a board, whether its views suffice.

May import geometry, pictures.
"""
