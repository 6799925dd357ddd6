"""The touched object: searched for in all cameras, its silhouette measured in each, its place in space.

May import geometry, pictures, wire.
"""
