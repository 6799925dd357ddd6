"""What people read: tables, figures, overlays, summary, score of synthetic sessions, pooled runs.

May import all folders of bench but theory.
"""
