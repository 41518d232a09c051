"""All tests in two processes side by side, for two cores: python -m tests.halves [pytest's options].

Tests share no port, file or database: each writes to a folder of its own, and servers take a free port. The end-to-end
run and all folders that nobody names here are the first half, shown as it goes; `SECOND` is the other, shown after it.
The exit status is 0 only if both halves are.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

HOME = Path(__file__).parent.parent
SECOND = ("tests/diagnosis", "tests/fuzz", "tests/measured", "tests/sim")
"""What takes as long as the rest, about."""


def commands(options: list[str]) -> tuple[list[str], list[str]]:
    """Both halves; what is not in the second is in the first, whatever folders are added."""
    pytest = [sys.executable, "-m", "pytest", "-q", *options]
    first = [*pytest, *(f"--ignore={path}" for path in SECOND), "tests"]
    return first, [*pytest, "-o", "cache_dir=.pytest_cache/second", *SECOND]


def main(options: list[str]) -> int:
    """Run both to their end; an interrupt reaches both, as they stand in one group of processes."""
    first, second = commands(options)
    with (
        tempfile.TemporaryFile("w+") as kept,
        subprocess.Popen(second, cwd=HOME, stdout=kept, stderr=subprocess.STDOUT) as other,
    ):
        status = [subprocess.run(first, cwd=HOME, check=False).returncode]
        print(f"The other half, {' '.join(SECOND)}:", flush=True)
        status.append(other.wait())
        kept.seek(0)
        print(kept.read(), end="", flush=True)
    if any(status):
        print(f"Tests failed: pytest ended with status {status[0]} and {status[1]}.", file=sys.stderr)
    return int(any(status))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
