"""Which numbers of the diagnosis move a verdict: each one halved and doubled, on the documents of `same_documents`.

    python -m benchmarks.diagnosis.threshold_day OUT --policy FOLDER [--workers N] [--dataset FOLDER ...]
    python -m benchmarks.diagnosis.threshold_day --table OUT [OUT ...] [--csv FILE]
    python -m benchmarks.diagnosis.threshold_day OUT --times 0.5 --of FILE    all at once that `moves nothing` in FILE

One run for all of them: while a document is made, every number that is read from `diagnosis.thresholds` carries its
half and its double along, through the arithmetic of scalars to the comparison that it decides. A number that is read
for comparisons alone, of which none comes out otherwise, moves nothing: the document would be the same to the byte. A
number that goes into an array or into a function in C is said to `enter`; what its half would do only a run with that
half tells. The documents themselves must come out as `same_documents` makes them: its `--compare` holds both folders
against each other. What cannot be seen (a number that goes into a text or a list) is found by the third command: it
makes the documents with all numbers halved or doubled that are said to move nothing, which must not change a byte.
"""

import argparse
import operator
import pkgutil
import sys
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.diagnosis import same_documents
from bumblebee.errors import EXIT_BAD_INPUT, BadInput

COUNTS = ("read", "seen", "compared", "half", "double", "array")
"""Columns: carriers made; of these whose use was seen; comparisons, those that half and double turn; other uses."""
_COMPARE = {np.less: operator.lt, np.less_equal: operator.le, np.greater: operator.gt, np.greater_equal: operator.ge,
            np.equal: operator.eq, np.not_equal: operator.ne}  # fmt: skip
_CHOOSE = (np.minimum, np.maximum, np.fmin, np.fmax)
_ARITHMETIC = ("add", "sub", "mul", "truediv", "floordiv", "pow", "mod")
counts: Counter[tuple[str, str]] = Counter()
"""Counts of this process, by number and column."""


def carried(value: object) -> bool:
    """Whether a value carries others."""
    return hasattr(type(value), "alternatives")


def plain(value: Any) -> Any:
    """A value without what it carries."""
    return value.bare() if carried(value) else value


def carry(value: Any, alternatives: dict[str, tuple[Any, Any]]) -> Any:
    """A scalar that carries halves and doubles by the number's name; anything else as it is."""
    kind = next((made for of, made in KINDS.items() if type(value) is of), None)
    if kind is None:
        for name in alternatives:
            counts[name, "array"] += 1
        return value
    made = kind(value)
    made.alternatives, made.used = alternatives, False
    for name in alternatives:
        counts[name, "read"] += 1
    return made


def worked(work: Callable[..., Any], *operands: Any) -> Any:
    """Result of a function, and what each half and double would make it: noted where it decides, else carried."""
    value, others = work(*map(plain, operands)), {}
    for name in dict.fromkeys(name for operand in operands if carried(operand) for name in operand.alternatives):
        for operand in operands:
            if carried(operand) and name in operand.alternatives and not operand.used:
                counts[name, "seen"] += 1
        others[name] = tuple(_tried(work, [_instead(operand, name, k) for operand in operands]) for k in (0, 1))
    for operand in operands:
        if carried(operand):
            operand.used = True
    if isinstance(value, (bool, np.bool_)) or (isinstance(value, np.ndarray) and value.dtype == bool):
        _decided(value, others)
        return value
    return carry(value, others)


def _decided(value: Any, others: dict[str, tuple[Any, Any]]) -> None:
    for name, (half, double) in others.items():
        counts[name, "compared"] += 1
        counts[name, "half"] += not np.array_equal(half, value)
        counts[name, "double"] += not np.array_equal(double, value)


def _instead(operand: Any, name: str, which: int) -> Any:
    return operand.alternatives.get(name, (plain(operand),) * 2)[which] if carried(operand) else operand


def _tried(work: Callable[..., Any], operands: list[Any]) -> Any:
    try:
        return work(*operands)
    except (ArithmeticError, ValueError, TypeError):
        return float("nan")


def _ufunc(self: Any, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
    if (
        method == "__call__"
        and not options
        and (ufunc in _COMPARE or all(np.ndim(plain(value)) == 0 for value in inputs))
    ):
        return worked(ufunc, *inputs)
    bare = getattr(ufunc, method)(*map(plain, inputs), **options)
    for value in inputs:
        if carried(value):
            chooses = ufunc in _CHOOSE and method == "__call__" and not options
            for name in value.alternatives:
                counts[name, "seen"] += not value.used
                if chooses:
                    told = [ufunc(*[_instead(operand, name, k) for operand in inputs]) for k in (0, 1)]
                    _decided(bare, {name: (told[0], told[1])})
                else:
                    counts[name, "array"] += 1
            value.used = True
    return bare


def _kind(base: type) -> type:
    """A number type whose instances carry."""
    body: dict[str, Any] = {"alternatives": {}, "used": False, "__array_ufunc__": _ufunc, "__hash__": base.__hash__}
    body["bare"] = lambda self: int.__int__(self) if base is int else base(float.__pos__(self))
    body["__reduce__"] = body["__reduce_ex__"] = lambda self, *_: (base, (self.bare(),))
    body["__deepcopy__"] = body["__copy__"] = lambda self, *_: self.bare()
    for name in ("lt", "le", "gt", "ge", "eq", "ne"):
        work = getattr(operator, name)
        body[f"__{name}__"] = lambda self, other, work=work: _two(work, self, other)
    for name in _ARITHMETIC:
        work = getattr(operator, name)
        body[f"__{name}__"] = lambda self, other, work=work: _two(work, self, other)
        body[f"__r{name}__"] = lambda self, other, work=work: _two(work, other, self)
    for name, made in (("float", float), ("int", int), ("index", int), ("format", format), ("str", str)):
        body[f"__{name}__"] = lambda self, *more, made=made: _left(made, self, *more)
    body["__neg__"] = lambda self: worked(operator.neg, self)
    body["__abs__"] = lambda self: worked(abs, self)
    return type(f"Carrying{base.__name__}", (base,), body)


def _left(made: Callable[..., Any], value: Any, *more: Any) -> Any:
    for name in value.alternatives:
        counts[name, "array"] += 1
    return made(value.bare(), *more)


def _two(work: Callable[..., Any], left: Any, right: Any) -> Any:
    if not all(isinstance(side, (int, float, np.generic, np.ndarray)) for side in (left, right)):
        return NotImplemented
    return worked(work, left, right)


KINDS = {float: _kind(float), int: _kind(int), np.float64: _kind(np.float64)}


def rules() -> dict[str, type]:
    """Dataclasses of numbers of the diagnosis, by name."""
    import bumblebee.diagnosis.thresholds as package

    modules = [import_module(found.name) for found in pkgutil.walk_packages(package.__path__, package.__name__ + ".")]
    modules.append(import_module("bumblebee.diagnosis.config"))
    made = (value for module in modules for value in vars(module).values())
    return {kind.__name__: kind for kind in made if isinstance(kind, type) and is_dataclass(kind)}


def numbers() -> dict[str, float]:
    """Every number field of them, `Class.field`, and what it is."""
    return {
        f"{owner}.{field.name}": field.default
        for owner, kind in sorted(rules().items())
        for field in fields(kind)
        if isinstance(field.default, (int, float)) and not isinstance(field.default, bool)
    }


def observe() -> None:
    """From here on every number of the diagnosis that is read carries its half and its double."""
    for owner, kind in rules().items():
        names = {field.name for field in fields(kind)}

        def read(self: Any, name: str, owner: str = owner, names: set[str] = names) -> Any:
            value = object.__getattribute__(self, name)
            bare = plain(value)
            if name not in names or type(bare) not in (int, float):
                return value
            double = 2 * bare
            return carry(bare, {f"{owner}.{name}": (bare // 2 if type(bare) is int else bare / 2, double)})

        kind.__getattribute__ = read  # type: ignore[method-assign]


def multiply(names: set[str], times: float) -> None:
    """From here on some numbers of the diagnosis are read as so many times what they are."""
    for owner, kind in rules().items():

        def read(self: Any, name: str, owner: str = owner) -> Any:
            value = object.__getattribute__(self, name)
            return type(value)(times * value) if f"{owner}.{name}" in names else value

        kind.__getattribute__ = read  # type: ignore[method-assign]


def _multiplied(job: Any, policy: Path | None, out: Path, names: set[str], times: float) -> str:
    multiply(names, times)
    return same_documents.write(job, policy, out)


def _observed(job: Any, policy: Path | None, out: Path) -> str:
    observe()
    counts.clear()
    told = same_documents.write(job, policy, out)
    rows = [{"number": name, **{c: counts[name, c] for c in COUNTS}} for name in {name for name, _ in counts}]
    pd.DataFrame(rows, columns=["number", *COUNTS]).to_csv(out / f"{told}.csv", index=False)
    return told


def run(options: argparse.Namespace) -> None:
    """Every document that is not there yet."""
    same_documents.single_threads()
    options.out.mkdir(parents=True, exist_ok=True)
    work, more = _observed, tuple[Any, ...]()
    if options.times is not None:
        told = pd.read_csv(options.of)
        work, more = _multiplied, (set(told["number"][told["says"] == "moves nothing"]), options.times)
    with ProcessPoolExecutor(options.workers, max_tasks_per_child=1) as pool:
        done = [pool.submit(work, job, options.policy, options.out, *more) for job in same_documents.left(options)]
        for future in as_completed(done):
            print(future.result(), flush=True)


def table(folders: list[Path]) -> pd.DataFrame:
    """A row a number: its value, in how many documents it is read, its counts, and what they say."""
    parts = [pd.read_csv(path) for folder in folders for path in sorted(folder.glob("*.csv"))]
    if not parts:
        raise BadInput("--table", "folders of finished runs", "none with a CSV file")
    together = pd.concat(parts, ignore_index=True).groupby("number")
    every = pd.Series(numbers(), name="value").rename_axis("number").to_frame()
    every["documents"] = together.size().reindex(every.index, fill_value=0)
    every = every.join(together[list(COUNTS)].sum()).fillna(0)
    every[list(COUNTS)] = every[list(COUNTS)].astype(int)
    every["says"] = [_verdict(row) for row in every.itertuples()]
    return every


def _verdict(row: Any) -> str:
    if not row.documents:
        return "never read"
    if row.array or row.seen < row.read:
        return "enters"
    return "decides" if row.half or row.double else "moves nothing"


def main(argv: list[str] | None = None) -> int:
    """Run, or print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.diagnosis.threshold_day",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    same_documents.add_options(parser)
    parser.add_argument("--table", type=Path, nargs="+", metavar="OUT", help="folders of finished runs")
    parser.add_argument("--csv", type=Path, help="file for the whole table")
    parser.add_argument("--times", type=float, help="factor on all numbers of --of that move nothing")
    parser.add_argument("--of", type=Path, metavar="FILE", help="table of --csv")
    options = parser.parse_args(argv)
    try:
        if not options.table:
            if options.out is None or (options.times is None) != (options.of is None):
                raise BadInput("options", "OUT, with both --times and --of or neither, or --table", "others")
            run(options)
            return 0
        told = table(options.table)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    if options.csv:
        told.to_csv(options.csv)
    print(told["says"].value_counts().to_string())
    return 0


if __name__ == "__main__":
    sys.exit(main())
