"""A finding: what a check has to say about one place of one file."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Finding:
    """One broken rule: where, what was expected, what came, and whether the file can still be used."""

    file: str
    """Name of the file."""
    column: str
    """Column of the file, with the joint in brackets where one joint is meant."""
    row: int | None
    """First row at which the rule is broken; None where the whole file is meant."""
    rule: str
    """Name of the rule."""
    expected: str
    """Value that would have been accepted."""
    came: str
    """Value that was found instead."""
    fatal: bool
    """True: the file is set aside; False: it is used, and the person is told."""
    do: str = ""
    """Action that mends it, where the rule has one remedy."""

    @property
    def message(self) -> str:
        """The finding in one line."""
        row = "" if self.row is None else f", row {self.row}"
        line = f"{self.file}: column {self.column}{row}: rule {self.rule}: expected {self.expected}, came {self.came}"
        line = f"{line}. {self.do}" if self.do else line
        return " ".join(line.split())

    def as_dict(self) -> dict[str, Any]:
        """The fields and the line, for JSON and tables."""
        return asdict(self) | {"message": self.message}
