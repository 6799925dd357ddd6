"""What people read: tables, figures, overlays, summary, score of synthetic sessions, pooled runs.

May import analyses and what it may import.
"""
