"""The learning curve as a CSV file, a row an iteration, readable while training goes on."""

from pathlib import Path

import pandas as pd
from rsl_rl.utils.log_writer import LogWriter


class CurveWriter(LogWriter):
    """Appends rows to `path`; rows of iterations that will be trained again are dropped first.

    Args:
        path: the file; its first column is `iteration`.
        done: iterations that are finished, by the checkpoint that training goes on from.
    """

    def __init__(self, path: Path, done: int = 0) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._columns: list[str] | None = None
        self._row: dict[str, float] = {}
        if done and path.exists():
            kept = pd.read_csv(path, on_bad_lines="skip")
            kept = kept[kept["iteration"] <= done]
            kept.to_csv(path, index=False)
            self._columns = list(kept.columns)
        else:
            path.unlink(missing_ok=True)

    def add_scalar(self, tag: str, scalar_value: float, global_step: int) -> None:
        """Put a value into the row of iteration `global_step`."""
        if self._row and self._row["iteration"] != global_step:
            self.flush()
        self._row["iteration"] = global_step
        self._row[tag] = float(scalar_value)

    def flush(self) -> None:
        """Write the row."""
        if not self._row:
            return
        first = self._columns is None
        if self._columns is None:
            self._columns = list(self._row)
        values = [f"{self._row.get(name, float('nan')):.6g}" for name in self._columns]
        values[0] = str(int(self._row["iteration"]))
        with self.path.open("a") as file:
            if first:
                file.write(",".join(self._columns) + "\n")
            file.write(",".join(values) + "\n")
        self._row = {}

    def stop(self) -> None:
        """Write what is left."""
        self.flush()
