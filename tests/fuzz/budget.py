"""How long fuzzing may take: seconds a file in the suite, as many as asked for on demand (`BUMBLEBEE_FUZZ_SECONDS`).

In the suite the first rounds are repeated; the nightly job and `make fuzz` ask for more, and begin somewhere else.
"""

import os
import time
from collections.abc import Iterator

SECONDS = float(os.environ.get("BUMBLEBEE_FUZZ_SECONDS", "6"))


def rounds(share: float = 1.0) -> Iterator[int]:
    """Counts 0, 1, 2 ... until the share of the file's seconds is used up; at least one round."""
    end, number = time.monotonic() + SECONDS * share, 0
    while number == 0 or time.monotonic() < end:
        yield number
        number += 1
