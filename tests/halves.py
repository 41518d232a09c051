"""All tests in two processes side by side, for two cores: python -m tests.halves [pytest's options].

Tests share no port, file or database: each writes to a folder of its own, and servers take a free port. `PROCESSES`
is the one half, kept and shown at the end; every other folder, those too that nobody has thought of yet, is the other,
shown as it goes. The exit status is 0 only if both halves' are.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

HOME = Path(__file__).parent.parent
PROCESSES = ("tests/e2e", "tests/flows", "tests/learning", "tests/measured", "tests/motion", "tests/tasks")
"""Where programs, servers, ranks and files are waited for: about as long as all that computes."""


def commands(options: list[str]) -> tuple[list[str], list[str]]:
    """Both halves; what is not in `PROCESSES` is in the second. Each has a cache of its own."""
    pytest = [sys.executable, "-m", "pytest", "-q", *options]
    apart = [*pytest, "-o", "cache_dir=.pytest_cache/processes", *PROCESSES]
    return apart, [*pytest, *(f"--ignore={path}" for path in PROCESSES), "tests"]


def main(options: list[str]) -> int:
    """Run both to their end; an interrupt reaches both, as they stand in one group of processes."""
    apart, rest = commands(options)
    with tempfile.TemporaryFile("w+") as kept:
        with subprocess.Popen(apart, cwd=HOME, stdout=kept, stderr=subprocess.STDOUT) as other:
            status = [subprocess.run(rest, cwd=HOME, check=False).returncode, other.wait()]
        kept.seek(0)
        print(f"{' and '.join(PROCESSES)}, beside the above:\n{kept.read()}", end="", flush=True)
    if any(status):
        print(f"Tests failed: pytest ended with status {status[0]} above and {status[1]} beside.", file=sys.stderr)
    return int(any(status))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
