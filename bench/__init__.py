"""The bench: reads a recorded session, holds truth and estimate side by side, and reports."""
