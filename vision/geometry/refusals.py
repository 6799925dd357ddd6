"""The one way in which vision says no."""

from vision.geometry.reasons import Reason


class Refused(ValueError):
    """What was seen cannot give the truth; one line says what was found, what is allowed, what to record.

    code: of the kind of refusal.
    """

    def __init__(self, sentence: str, code: str = "refused"):
        super().__init__(sentence)
        self.code = code

    @property
    def reason(self) -> Reason:
        """Return the sentence with its code."""
        return Reason(self.code, str(self))


class TooFewFrames(Refused):
    """Of a stroke's frames too few were looked at: all of them may tell more."""


class Misled(Refused):
    """One camera shows something else than the others: `camera` is its name. Without it there may be a truth."""

    def __init__(self, camera: str, reason: str):
        super().__init__(f"camera {camera} was left out: {reason}", code="camera_lines_scatter")
        self.camera = camera
