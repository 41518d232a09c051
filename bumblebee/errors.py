"""The errors that a user is meant to read: one line each, and the process ends with status 2."""

EXIT_BAD_INPUT = 2


def plain(text: str) -> str:
    """`text` with a mark in the place of every sign that could move a terminal; line ends stay."""
    return "".join(sign if sign.isprintable() or sign == "\n" else "\ufffd" for sign in text)


class BadInput(Exception):
    """Input that cannot be used; the text names the place, the expectation, what came and the remedy.

    Args:
        where: file, and row, column, field or key in it.
        expected: what would have been accepted.
        came: what was found instead.
        do: what the user can do about it.
    """

    def __init__(self, where: object, expected: str, came: str, do: str = "") -> None:
        self.where, self.expected, self.came, self.do = str(where), expected, came, do
        line = f"{where}: expected {expected}, came {came}"
        words = " ".join((f"{line}. {do}" if do else line).split())
        # Names and values come from files: no control character of theirs reaches a terminal or a log.
        super().__init__(plain(words))

    def __reduce__(self) -> tuple[type["BadInput"], tuple[str, ...]]:
        """Arguments that another process makes it from again: an exception is otherwise rebuilt from its text alone."""
        return type(self), (self.where, self.expected, self.came, self.do)
