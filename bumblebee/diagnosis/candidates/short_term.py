"""The text of a law, cut to what a line holds."""

import re

_PART = re.compile(r"'[^']*'|\"[^\"]*\"|\w+[(\[]|(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|\w+|[)\]]),?|.", re.DOTALL)
_ENDS = {"(": ")", "[": "]"}


def short_term(text: str, most: int) -> str:
    """`text`, or its beginning in `most` characters with an ellipsis and its brackets closed: `curve(q, -0.1, ...)`.

    It is cut between numbers, names and signs: no number is cut.
    """
    if len(text) <= most:
        return text
    kept: list[str] = []
    for part in _PART.findall(text):
        if len(_closed([*kept, part])) > most:
            break
        kept.append(part)
    return _closed(kept)


def _closed(parts: list[str]) -> str:
    """The parts with an ellipsis in the place of what follows."""
    open_: list[str] = []
    for part in parts:
        if part[-1] in _ENDS and part[0] not in "'\"":
            open_.append(_ENDS[part[-1]])
        elif part[0] in ")]":
            open_.pop()
    begin = "".join(parts).rstrip(" -+*/^")
    space = "" if not begin or begin[-1] in "([" else " "
    return f"{begin}{space}...{''.join(reversed(open_))}"
