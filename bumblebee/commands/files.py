"""Options of the commands that read motion files: what the files leave unsaid."""

from typing import Annotated

import typer

CsvFps = Annotated[
    float | None, typer.Option("--csv-fps", min=1, max=1000, help="Rate of CSV files in Hz, which hold none.")
]
Settings = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Facts that files lack: docs/data.md.")
]
