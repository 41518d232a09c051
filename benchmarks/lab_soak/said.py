"""Which lines of what a loop says tell of a fault, and what each of them is called."""

import re

TELLS = re.compile(
    r"error|exceptions?\b|traceback|failed|expected|lost|went away|refused|no space|disk|crash|timed out|cannot|"
    r"could not|ending|gone|not started|hung|denied|unavailable|retry",
    re.IGNORECASE,
)
UNFORESEEN = "internal error"
TRACEBACK = "Traceback (most recent call last)"
LINES, LENGTH = 200, 400

# Kinds of benchmarks.lab_soak.faults.
WORKER, DATABASE, STORE = "worker killed", "database killed", ("S3 ended", "S3 answers nothing")
FLOW, PREFECT, MLFLOW = ("keeper killed", "flow killed"), "Prefect's server killed", "MLflow's server killed"
FULL = ("worker's disk full", "workspace's disk full")

Named = tuple[re.Pattern[str], tuple[str, ...]]
NAMED: dict[str, Named] = {
    "no error: how a policy did": (re.compile(r"[:,] success .* key error"), ()),
    "no error of its own: stages that wait for a failed one": (
        re.compile(
            r"Finished in state (Failed|NotReady)|\| failed after \d+:\d\d min: |^\d+ stage\(s\) failed, |"
            r"ERROR: failed to reproduce|^[a-z]+( round \d+)?( c\d+)?: .* / |the same command goes on from there$"
        ),
        (),
    ),
    "a machine was lost, its stage starts again elsewhere": (
        re.compile("its machine was lost; (the stage starts|another one goes on from its last checkpoint)"),
        (WORKER,),
    ),
    "a machine was lost while a start looked at all of them": (
        re.compile("expected every machine of the Ray cluster to answer"),
        (WORKER,),
    ),
    "what Ray says of a machine that was lost": (re.compile(r"\(raylet\)"), (WORKER,)),
    "Prefect's server is gone, the stages go on": (re.compile("^Prefect's server went away"), (PREFECT,)),
    "Prefect's log finds no server": (
        re.compile("^--- Error logging to API ---|^All connection attempts failed"),
        (PREFECT, *FLOW, DATABASE),
    ),
    "a disk is full": (re.compile("expected a disk that takes the output"), FULL),
    "a lab's server is away as a stage is recorded": (
        re.compile("expected the lab's database and store to answer"),
        (DATABASE, *STORE),
    ),
    "a lab's server is away before anything starts": (
        re.compile(r"lab\.yaml: (prefect|mlflow)\.(database|artifacts): expected"),
        (DATABASE, *STORE),
    ),
    "Prefect's server has no database": (
        re.compile(
            r"^Server error '500 Internal Server Error'.*/api/|the progress on Prefect's page stands still|"
            r"^Prefect's server could not keep how the run"
        ),
        (DATABASE,),
    ),
    "MLflow's server is gone, its page is closed": (re.compile("^MLflow's server went away"), (MLFLOW,)),
    "the process that started it is gone": (re.compile("the process that started this one is gone: ending"), FLOW),
}
"""Name -> the lines that it means, and the faults of which one must have been there; none for what is no error."""


def telling(text: str) -> list[str]:
    """Lines that tell of a fault, each shape once, without their time; of a traceback its head and its error."""
    found: dict[str, str] = {}
    inside = False
    for line in text.splitlines():
        plain = re.sub(r"^\d\d:\d\d:\d\d(\.\d+)? ", "", line)
        inside = (inside and plain.startswith(" ")) or plain.startswith(TRACEBACK)
        if TELLS.search(plain) and (not inside or plain.startswith(TRACEBACK)):
            plain = plain.strip()[:LENGTH]
            found.setdefault(re.sub(r"[0-9a-f]{6,}|\d+", "#", plain), plain)
    return list(found.values())[:LINES]


def name_of(line: str) -> str | None:
    """Name of the line; None for one that nobody has named, and for what the code itself did not foresee."""
    if UNFORESEEN in line:
        return None
    return next((name for name, (pattern, _) in NAMED.items() if pattern.search(line)), None)
