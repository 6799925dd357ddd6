"""The exception by which vision refuses what it cannot evaluate."""

from vision.geometry.reasons import Reason


class Refused(ValueError):
    """Pictures or settings from which no truth can be had.

    The message is one line: what was found, what is allowed, what to record. code: kind of refusal.
    """

    def __init__(self, sentence: str, code: str = "refused"):
        """Keep the code with the message."""
        super().__init__(sentence)
        self.code = code

    @property
    def reason(self) -> Reason:
        """Return the sentence with its code."""
        return Reason(self.code, str(self))


class Misled(Refused):
    """One camera contradicts the others: `camera` is its name. Without it there may be a truth."""

    def __init__(self, camera: str, reason: str):
        """Name the camera in the message."""
        super().__init__(f"camera {camera} was left out: {reason}", code="camera_lines_scatter")
        self.camera = camera
