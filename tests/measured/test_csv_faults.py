"""A CSV file that cannot be read: one line says which line of it is wrong and what to do, in no library's words."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bumblebee.cli import app
from bumblebee.errors import BadInput
from bumblebee.measured.tables import read_csv

ROWS = "time,q,u\n0,1,2\n0.02,1,2\n"


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (ROWS + "0.04,1,2,3\n", "log.csv: line 4: expected 3 fields, as in the lines above it, came 4. Mend or remove"),
        ("# arm\n# lab\n" + ROWS, "line 3: expected 1 fields, as in the lines above it, came 3. * above the header"),
        ("# arm\n" + ROWS, "expected 1 cells a row, as the header has names (# arm), came 3. * above the header"),
        (
            ROWS.replace("2\n", "2,\n"),
            "expected 3 cells a row, as the header has names (time, q, u), came 4. *at the end",
        ),
        (ROWS + '0.04,"1,2\n', "line 4: expected a quoted cell that ends, came a quote that is never closed"),
        ("\ufeff" + ROWS + "0.04,1,é\n", "line 4: expected text in UTF-8, came the byte 0xe9. Save it as UTF-8."),
        ("", "expected a header and rows, came an empty file. Take it out of what is imported."),
    ],
)
def test_a_line_says_what_is_wrong_and_where(content: str, line: str) -> None:
    coded = content.encode()
    coded = coded.replace("é".encode(), "é".encode("latin-1"))
    with pytest.raises(BadInput, match=re.escape(line).replace(r"\ \*", ".*")) as caught:
        read_csv("log.csv", coded)
    assert not re.search("Error|pandas|tokeniz", str(caught.value))


def test_a_file_without_rows_and_a_dataset_that_exists_say_what_to_do(tmp_path: Path) -> None:
    logs, out, columns = tmp_path / "logs", tmp_path / "out", tmp_path / "map.yaml"
    logs.mkdir()
    columns.write_text("joints: [hip]\ncolumns: {joint_pos: [q], joint_target: [u]}\n")
    (logs / "a.csv").write_text(ROWS)
    (logs / "b.csv").write_text("time,q,u\n")
    command = ["import", str(logs), str(out), "--kind", "csv", "--columns", str(columns)]
    refused = CliRunner().invoke(app, command).exception
    assert isinstance(refused, BadInput) and "b.csv" in str(refused) and "Take the file out" in str(refused)
    assert not out.exists()
    (logs / "b.csv").write_text("# arm, left\n")
    assert "The header must be the first line" in str(CliRunner().invoke(app, command).exception)
    out.mkdir()
    assert "Nothing is replaced: choose another" in str(CliRunner().invoke(app, command).exception)
