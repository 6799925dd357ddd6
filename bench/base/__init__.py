"""What every part of the bench needs: errors, warnings, atomic files, results and hashes, workers, settings, drawing.

Imports nothing else of bench.
"""
