"""Many files in few lines: reasons that differ in numbers only are one line, with the range of each."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from bumblebee.errors import plain

_NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?!\.?\w)")


@dataclass(frozen=True)
class Told:
    """One line about one or more files."""

    line: str
    files: tuple[str, ...]

    @property
    def whose(self) -> str:
        """The file, or how many."""
        return self.files[0] if len(self.files) == 1 else f"{len(self.files):,} files"


def few_lines(said: Iterable[tuple[str, str]]) -> list[Told]:
    """The lines, those about most files first.

    Args:
        said: file and line, in the order in which files are to be named.
    """
    kinds: dict[tuple[str, ...], list[tuple[str, list[str]]]] = {}
    for file, line in said:
        kinds.setdefault(tuple(_NUMBER.split(line)), []).append((file, _NUMBER.findall(line)))
    told = [Told(_joined(words, [numbers for _, numbers in group]), tuple(dict.fromkeys(file for file, _ in group)))
            for words, group in kinds.items()]  # fmt: skip
    return sorted(told, key=lambda one: -len(one.files))


def said_of(word: str, said: Iterable[tuple[str, str]]) -> list[str]:
    """The lines after a word such as `skipped`, each with its file or how many there are; `said` as above."""
    return [plain(f"{word}: {told.line.removesuffix('.')}: {told.whose}") for told in few_lines(said)]


def _joined(words: tuple[str, ...], numbers: list[list[str]]) -> str:
    """The words with the range of the numbers between them."""
    ranges = [_range(column) for column in zip(*numbers, strict=True)]
    return words[0] + "".join(number + after for number, after in zip(ranges, words[1:], strict=True))


def _range(numbers: tuple[str, ...]) -> str:
    least, most = min(numbers, key=float), max(numbers, key=float)
    return least if float(least) == float(most) else f"{least} to {most}"
