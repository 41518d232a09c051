"""How large, long, deep and many: what a file from outside may be before it is refused."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Bounds of one input; a real log or motion stays a hundred times below most of them."""

    file_bytes: int = 1 << 30
    """Largest size of one file as it lies on disk."""
    unpacked_bytes: int = 1 << 30
    """Largest size of everything that one archive or compressed file unpacks to, together."""
    ratio: float = 2000.0
    """Unpacked over packed bytes of one member beyond `free_bytes`; deflate itself cannot exceed 1032."""
    free_bytes: int = 64 << 20
    """Unpacked bytes below which the ratio is not asked: constant channels compress well."""
    members: int = 100_000
    """Files in one archive."""
    rows: int = 20_000_000
    """Rows of one table: 11 hours at 500 Hz."""
    text_bytes: int = 16 << 20
    """Largest size of a file of settings (YAML, JSON)."""
    depth: int = 40
    """Nesting of a file of settings."""
    nodes: int = 200_000
    """Values in a file of settings, aliases counted as often as they are used."""


LIMITS = Limits()
