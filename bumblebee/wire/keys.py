"""What the console tells the guard, and how often: the keys, as counts and as a time."""

from dataclasses import dataclass

import numpy as np

_LAYOUT = np.dtype([("held_ns", "<i8"), ("goes", "<i4"), ("stops", "<i4"), ("ends", "<i4")])


@dataclass(frozen=True)
class Keys:
    """Keys so far; a count that grows is a key pressed again."""

    held_ns: int
    """When the dead-man's key was seen last, by the run's clock [ns]."""
    goes: int = 0
    """Go: 1 stands up, 2 lets the policy run."""
    stops: int = 0
    """Stop: 1 damps, 2 takes the torque off."""
    ends: int = 0
    """End of the run in good order: damps where the robot has done its clip."""


def encode_keys(keys: Keys) -> bytes:
    """Bytes of the keys."""
    return np.array([(keys.held_ns, keys.goes, keys.stops, keys.ends)], _LAYOUT).tobytes()


def decode_keys(message: bytes) -> Keys:
    """What `encode_keys` wrote."""
    return Keys(*(int(value) for value in np.frombuffer(message, _LAYOUT, 1)[0]))
