"""Where a library keeps its files."""

import re
from pathlib import Path

_SHARD = re.compile(r"[0-9a-f]{32}")


def path_of(folder: Path, stem: str) -> Path:
    """The file of a shard, or of a clip in a file of its own."""
    return Path(folder) / "clips" / f"{stem}.parquet"


def names_shard(text: str) -> bool:
    """Whether a shard can have this name."""
    return _SHARD.fullmatch(text) is not None


def is_shard(path: Path) -> bool:
    """Whether a file is called as shards are."""
    return path.suffix == ".parquet" and names_shard(path.stem)
