"""Bad input, named in one clear sentence: what, where, expected, received.

Everything that a person can get wrong (a file, a value, a clip) ends in a `Refusal`.  The command line
prints its sentence and exits with status 1; a stage that handles many clips lists it and goes on.
"""

from __future__ import annotations


class Refusal(ValueError):
    """Input that cannot be used, in one sentence.

    Parameters
    ----------
    what : str
        What is wrong, e.g. ``"the file is truncated"``.
    where : str
        The file, option or clip, e.g. ``"walk.c3d, byte 512"``.
    expected, received : str
        What would have been right, and what came instead; both optional.

    Examples
    --------
    >>> print(Refusal("the rate is not positive", where="a.trc", expected="hertz > 0", received="-1"))
    a.trc: the rate is not positive (expected hertz > 0, received -1)
    """

    def __init__(self, what: str, *, where: str = "", expected: str = "", received: str = "") -> None:
        details = ", ".join(
            f"{label} {value}" for label, value in (("expected", expected), ("received", received)) if value
        )
        sentence = f"{where}: {what}" if where else what
        super().__init__(f"{sentence} ({details})" if details else sentence)
        self.what = what
        self.where = where
        self.expected = expected
        self.received = received

    def __reduce__(self) -> tuple:
        return (_rebuild, (self.what, self.where, self.expected, self.received))


def _rebuild(what: str, where: str, expected: str, received: str) -> Refusal:
    return Refusal(what, where=where, expected=expected, received=received)
