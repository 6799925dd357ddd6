"""What every part of the bench needs: errors, doubts, atomic files, results and hashes, workers, settings, drawing.

Imports nothing else of bench.
"""
