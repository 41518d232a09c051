"""Which motion of AMASS a file is, by its path; HumanML3D's index and AMASS's downloads spell some differently.

A motion is named by data set, subject and name: `KIT/3/kick_high_left02_poses.npz` is (KIT, 3, kick_high_left02).
"""

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

Key = tuple[str, str, str]
"""Data set as HumanML3D spells it, subject, name of the motion."""

# Folders of the downloads beside the names that HumanML3D's index has; the pairs are listed at the head of HumanML3D's
# raw_pose_processing.ipynb. EyesJapanDataset is the name of an archive.
_SETS = {
    "ACCAD": (),
    "BMLhandball": (),
    "BMLmovi": (),
    "BioMotionLab_NTroje": ("BMLrub",),
    "CMU": (),
    "DFaust_67": ("DFaust",),
    "EKUT": (),
    "Eyes_Japan_Dataset": ("EyesJapanDataset",),
    "HumanEva": (),
    "KIT": (),
    "MPI_HDM05": ("HDM05",),
    "MPI_Limits": ("PosePrior",),
    "MPI_mosh": ("MoSh",),
    "SFU": (),
    "SSM_synced": ("SSM",),
    "TotalCapture": (),
    "Transitions_mocap": ("Transitions",),
    "humanact12": (),
}
SET_OF = {alias.casefold(): name for name, aliases in _SETS.items() for alias in (name, *aliases)}

CUT_AT_START = {
    "Eyes_Japan_Dataset": 60,
    "MPI_HDM05": 60,
    "TotalCapture": 20,
    "MPI_Limits": 20,
    "Transitions_mocap": 10,
}
"""Frames at 20 Hz that HumanML3D cut from the start of each motion of a data set, where people stand in a T or A pose,
before its index counts: frame 0 of the index is the first after the cut. Source: the last cell of HumanML3D's
raw_pose_processing.ipynb; that the index counts after the cut is said in issue 114 of EricGuo5513/HumanML3D."""

_ENDINGS = re.compile(r"_(poses|stageii)$")
_ARCHIVES = re.compile(r"\.(zip|tar|tgz|tbz2|tar\.(gz|bz2|xz))$", re.IGNORECASE)
_CMU_NAME = re.compile(r"\d{2,3}_\d{2,3}")
_CMU_PLACE = re.compile(r"(?<![a-z])cmu", re.IGNORECASE)
_CMU_LEVELS = 3  # folders above a file: archive, folder in it, subject


def key_of_index(source_path: str) -> Key | None:
    """The motion that a row of HumanML3D's index means: `./pose_data/KIT/3/kick_high_left02_poses.npy`."""
    parts = PurePosixPath(source_path).parts
    if len(parts) < 3 or ".." in parts or parts[-3].casefold() not in SET_OF:
        return None
    return SET_OF[parts[-3].casefold()], _spelled(parts[-2]), _name(PurePosixPath(parts[-1]).stem)


def is_smplx(path: Path) -> bool:
    """Whether AMASS made the file with SMPL-X, whose frame rates often disagree with those of SMPL-H."""
    return path.stem.endswith("_stageii")


@dataclass(frozen=True)
class Found:
    """Motion that a path was taken for, or none, with the reason where one might have been expected."""

    key: Key | None = None
    note: str = ""


class Motions:
    """The motions of an index, found by the paths and names under which files have them."""

    def __init__(self, keys: Iterable[Key]) -> None:
        self._keys = frozenset(keys)
        self._by_tail: dict[tuple[str, str], list[Key]] = defaultdict(list)
        self._by_cmu_name: dict[str, list[Key]] = defaultdict(list)
        self._by_joined: dict[str, list[Key]] = defaultdict(list)
        for key in sorted(self._keys):
            data_set, subject, name = key
            self._by_tail[subject, name].append(key)
            if data_set == "CMU":
                self._by_cmu_name[name].append(key)
            for spelling in (data_set, *_SETS[data_set]):
                self._by_joined[f"{spelling}_{subject}_{name}"].append(key)

    def find(self, path: Path, motion_name: str = "") -> Found:
        """The motion that a file, a member of an archive or a motion in a file of several is; exact or none.

        By its last components `<data set>/<subject>/<name>`; by a name that joins the three, as PHC's pickles do
        (`0-KIT_3_kick_high_left02_poses`); by CMU's `NN_NN` below a folder or archive whose name has "cmu" in it.
        """
        above = [_ARCHIVES.sub("", part) for part in path.parts[:-1]]
        name = _name(path.stem)
        if len(above) >= 2:
            key = (SET_OF.get(above[-2].casefold(), ""), _spelled(above[-1]), name)
            if key in self._keys:
                return Found(key)
        for joined in {_name(re.sub(r"^\d+-", "", text)) for text in (motion_name, path.stem) if text}:
            if joined in self._by_joined:
                return _one(self._by_joined[joined], joined)
        if _CMU_NAME.fullmatch(name) and any(_CMU_PLACE.search(part) for part in above[-_CMU_LEVELS:]):
            return _one(self._by_cmu_name.get(name, []), name)
        near = self._by_tail.get((_spelled(above[-1]), name), []) if above else []
        if near:
            likely = "/".join(near[0])
            note = f"it may be {likely} of AMASS, but no folder {near[0][0]} above it says so: no text of HumanML3D"
            return Found(None, note)
        return Found()


def _one(keys: list[Key], name: str) -> Found:
    if len(keys) < 2:
        return Found(keys[0] if keys else None)
    meant = " or ".join("/".join(key) for key in keys[:4])
    return Found(None, f"{name} may be {meant}: no text of HumanML3D, which has one for each")


def _name(stem: str) -> str:
    return _spelled(_ENDINGS.sub("", stem))


def _spelled(text: str) -> str:
    """Spaces as underscores, as in AMASS's SMPL-X files, several as one, as in names that became names of files."""
    return re.sub(r"[ _]+", "_", text)
