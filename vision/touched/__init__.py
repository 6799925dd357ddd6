"""The bar in every camera: searched for, its line and edges measured, its axis in space.

May import geometry, pictures, lines.
"""
