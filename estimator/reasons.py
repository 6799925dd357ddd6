"""Sentences on what was felt, each with the code by which programs know it."""


class NamedReason(str):
    """Text of a sentence for people, with its code for programs.

    The code does not change with the words.
    """

    code: str

    def __new__(cls, code: str, sentence: str) -> "NamedReason":
        """Return the sentence with its code."""
        made = super().__new__(cls, sentence)
        made.code = code
        return made

    def __reduce__(self):
        """Return what pickle makes the sentence from, its code included."""
        return NamedReason, (self.code, str.__str__(self))

    def format(self, *values: object) -> "NamedReason":
        """Return the sentence with values in the places of its braces, under the same code."""
        return NamedReason(self.code, super().format(*values))
