"""Reads chosen arrays of an .npz file: what is not asked for is never unpacked, and nothing is executed.

AMASS's files carry arrays of pickled objects beside the motion (labels of markers): these are left alone.
"""

import io
import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS, Limits
from bumblebee.io.read import member_bytes, members, npy_array


def npz_keys(path: Path, data: bytes) -> set[str]:
    """The names of a file's arrays, without reading any.

    Raises:
        BadInput: no archive, or a damaged one.
    """
    return set(_directory(path, data))


def npz_chosen(path: Path, data: bytes, names: Collection[str], limits: Limits = LIMITS) -> dict[str, np.ndarray]:
    """Those of the named arrays that the file has.

    Raises:
        BadInput: damaged, hostile or too large; an array of pickled objects among those named.
    """
    found = {}
    for name, info in _directory(path, data, limits).items():
        if name in names:
            where = f"{path}: {name}"
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                found[name] = npy_array(where, member_bytes(where, archive, info, limits))
    return found


def _directory(path: Path, data: bytes, limits: Limits = LIMITS) -> dict[str, zipfile.ZipInfo]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return {info.filename.removesuffix(".npy"): info for info in members(path, archive, limits)}
    except BadInput:
        raise
    except Exception as error:  # a damaged directory raises anything from BadZipFile to UnicodeDecodeError
        raise BadInput(path, "a whole .npz file", f"{type(error).__name__}: {error}"[:160]) from None
