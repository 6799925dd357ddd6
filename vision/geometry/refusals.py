"""The one way in which vision says no."""


class Refused(ValueError):
    """What was seen cannot give the truth; one line says what was found, what is allowed, what to record."""


class TooFewFrames(Refused):
    """Of a stroke's frames too few were looked at: all of them may tell more."""


class Misled(Refused):
    """One camera shows something else than the others: `camera` is its name. Without it there may be a truth."""

    def __init__(self, camera: str, reason: str):
        super().__init__(f"camera {camera} was left out: {reason}")
        self.camera = camera
