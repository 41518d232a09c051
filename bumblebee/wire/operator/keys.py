"""The operator's keys: what each does, and what the console tells the guard of them."""

from dataclasses import dataclass, replace

import numpy as np

HOLD, GO, END, OFF = " ", "g", "q", "0"
"""Dead-man's key, go on, end in good order, torque off; every other key stops."""
HELP = "hold SPACE; g: go on; q: end after the clip; 0: torque off; ANY OTHER KEY: STOP"
_APART = 1_000_000_000  # ns between two presses of GO; a key that is held repeats sooner
_LAYOUT = np.dtype([("held_ns", "<i8"), ("goes", "<i4"), ("stops", "<i4"), ("ends", "<i4")])


@dataclass(frozen=True)
class Keys:
    """Keys so far."""

    held_ns: int
    """When one of the operator's own keys was seen last, by the run's clock [ns]."""
    goes: int = 0
    """Go: 1 stands up, 2 lets the policy run."""
    stops: int = 0
    """1: damps; 2: takes the torque off."""
    ends: int = 0
    """End of the run in good order: damps where the robot has done its clip."""


def encode_keys(keys: Keys) -> bytes:
    """Bytes of the keys."""
    return np.array([(keys.held_ns, keys.goes, keys.stops, keys.ends)], _LAYOUT).tobytes()


def decode_keys(message: bytes) -> Keys:
    """Keys from the bytes of `encode_keys`."""
    return Keys(*(int(value) for value in np.frombuffer(message, _LAYOUT, 1)[0]))


class Hand:
    """Keys of a run so far, from what a terminal says.

    Args:
        now: time [ns].
    """

    def __init__(self, now: int) -> None:
        self.keys, self._went = Keys(now), now - 2 * _APART

    def press(self, text: str, now: int) -> None:
        """Count keys that came now: a held GO counts once, and no held stop key ever takes the torque off."""
        keys = self.keys
        own = any(key in text for key in (HOLD, GO, END))
        goes = keys.goes + (GO in text and now - self._went > _APART)
        self._went = now if GO in text else self._went
        others = any(key not in (HOLD, GO, END) for key in text)
        stops = 2 if OFF in text else max(keys.stops, int(others))
        self.keys = Keys(now if own else keys.held_ns, goes, max(stops, keys.stops), keys.ends + (END in text))

    def stop(self) -> None:
        """Stop, as by any key."""
        self.keys = replace(self.keys, stops=max(self.keys.stops, 1))
