"""The one way in which vision says no."""


class Refused(ValueError):
    """What was seen cannot give the truth; one line says what was found, what is allowed, what to record."""
