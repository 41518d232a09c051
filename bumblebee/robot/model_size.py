"""How large an MJCF may be, before MuJoCo looks at it."""

import math
import re
from pathlib import Path

from bumblebee.errors import BadInput

LARGEST = 64 << 20  # bytes of the XML itself; the largest public robot models have 1 MB
MEMORY = 8 << 30  # bytes that a model may ask for its arena
_MULTIPLIERS = (
    ("replicate", ("count",), 1e5),
    ("composite", ("count",), 1e6),
    ("flexcomp", ("count",), 1e6),
    ("texture", ("width", "height"), 1e8),
    ("hfield", ("nrow", "ncol"), 1e8),
)


def refuse_multiplied(path: Path, text: str) -> None:
    """Refuse numbers in a model that make a few bytes into gigabytes before MuJoCo looks at them."""
    for tag, keys, most in _MULTIPLIERS:
        for element in re.findall(rf"<{tag}\b[^>]*>", text):
            found = [re.findall(rf"\b{key}\s*=\s*[\"']([^\"']*)", element) for key in keys]
            numbers = [float(n) for words in found for n in re.findall(r"\d+(?:\.\d+)?", " ".join(words))]
            size = math.prod(numbers) if numbers else 0.0
            if not size <= most:
                raise BadInput(path, f"a {tag} of at most {most:g} ({' x '.join(keys)})", f"{size:.3g}")
    for size, unit in re.findall(r"\bmemory\s*=\s*[\"']\s*(\d+)\s*([KMGTPE]?)", text):
        if float(size) * 1024 ** " KMGTPE".index(unit or " ") > MEMORY:
            raise BadInput(path, f"memory of at most {MEMORY:,} bytes", f"{size[:40]}{unit}")
