"""The library of clips on disk: written as a stream, appended to, read as lazily as one likes.

- `index.parquet`: one row a clip, with its place
- `clips/<hash of the file>.parquet`: shards, some hundred clips each
- `skipped.csv`: source files that are not in the library, and why

`docs/decisions/motion-store.md` says why it is laid out so.
"""

from bumblebee.motion.store.index import INDEX_COLUMNS, index_of, read_index
from bumblebee.motion.store.library import Library, read_library
from bumblebee.motion.store.one_file import read_clip, write_clip
from bumblebee.motion.store.work import map_clips
from bumblebee.motion.store.writer import LibraryWriter, write_library

__all__ = [
    "INDEX_COLUMNS",
    "Library",
    "LibraryWriter",
    "index_of",
    "map_clips",
    "read_clip",
    "read_index",
    "read_library",
    "write_clip",
    "write_library",
]
