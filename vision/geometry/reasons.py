"""Sentences on what was seen, which carry the codes by which programs know them.

People read the text, and its words may change. A program that must know what kind of sentence it is
asks for the code, which does not.
"""

from collections.abc import Iterable

# The code of a sentence whose maker gave it none.
UNNAMED = "unnamed"


class Reason(str):
    """Text of one sentence, or of several joined by "; ", with the code of each.

    parts: (code, sentence) of each sentence, in order. A text without words has no parts.
    """

    parts: tuple[tuple[str, str], ...]

    def __new__(cls, code: str, sentence: str | None) -> "Reason":
        """Return the reason of one sentence; of no sentence where that is empty or None."""
        return cls.of_parts([(code, sentence)] if sentence else [])

    @classmethod
    def of_parts(cls, parts: Iterable[tuple[str, str]]) -> "Reason":
        """Return the reason made of (code, sentence) pairs."""
        pairs = tuple((str(code), str(sentence)) for code, sentence in parts)
        made = super().__new__(cls, "; ".join(sentence for _, sentence in pairs))
        made.parts = pairs
        return made

    def __reduce__(self):
        """Return what pickle makes the reason from, its codes included."""
        return Reason.of_parts, (self.parts,)

    @property
    def codes(self) -> tuple[str, ...]:
        """Return the code of each sentence, in order."""
        return tuple(code for code, _ in self.parts)

    def about(self, subject: str) -> "Reason":
        """Return the reason with the name of its subject before the first sentence."""
        if not self.parts:
            return self
        (code, sentence), *rest = self.parts
        return Reason.of_parts([(code, f"{subject}: {sentence}"), *rest])


# Nothing to say.
NO_REASON = Reason("", "")


def as_reason(text: str | None) -> Reason:
    """Return any text as a reason.

    A text that is none already has the code of its attribute `code`, where it has one, else
    UNNAMED.
    """
    if isinstance(text, Reason):
        return text
    return Reason(getattr(text, "code", UNNAMED), text)


def joined(*texts: str | None) -> Reason:
    """Return several reasons as one, in order; empty ones are left out."""
    reasons = [as_reason(text) for text in texts if text]
    return Reason.of_parts(part for reason in reasons for part in reason.parts)
