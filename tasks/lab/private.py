"""Folders that nobody but their owner can look into: the servers' own, and DVC's index."""

import os
import shutil
import stat
from contextlib import suppress
from pathlib import Path
from shlex import quote

from configobj import ConfigObj  # as DVC reads its settings

from bumblebee.errors import BadInput
from bumblebee.last_line import OTHERS_WRITE, guarded

INDEX = Path(".dvc") / "tmp" / "site"  # DVC's databases; by default it keeps them where all users of the machine write


def private(folder: Path) -> Path:
    """Make the folder, or take it over, so that nobody but the owner can look into it.

    Raises:
        BadInput: when it is a link, no folder, or somebody else's.
    """
    with suppress(FileExistsError):
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.geteuid():
        came = "a link or a file" if not stat.S_ISDIR(found.st_mode) else f"one of user {found.st_uid}"
        raise BadInput(folder, "a folder of your own", came, f"{put_aside(folder)}, then start again.")
    if stat.S_IMODE(found.st_mode) & 0o077:
        folder.chmod(0o700)
    return folder


def put_aside(path: Path) -> str:
    """The command that moves a file or folder out of the way."""
    return f"mv {quote(str(path))} {quote(f'{path}.old')}"


def private_index(workspace: Path, remake: bool = True) -> None:
    """Give DVC a private folder for its databases in the workspace, which plain `dvc repro` uses as well.

    DVC makes that folder with mode 777 where it is missing. Its databases only save it from hashing files again.

    Args:
        workspace: the folder with dvc.yaml; its `.dvc/config.local` names the folder afterwards.
        remake: remove what others could write to; otherwise, as while DVC has it open, close it only.

    Raises:
        BadInput: when the folder is somebody else's.
    """
    folder = workspace.resolve() / INDEX
    for place in (folder, folder / "repo"):
        with suppress(FileNotFoundError):
            found = place.lstat().st_mode
            if remake and stat.S_ISDIR(found) and found & OTHERS_WRITE:
                shutil.rmtree(place)
        private(place)
    settings = local_settings(workspace)
    if settings.get("core", {}).get("site_cache_dir") != str(folder):
        settings.merge({"core": {"site_cache_dir": str(folder)}})
        write_settings(settings)


def local_settings(workspace: Path) -> ConfigObj:
    """DVC's settings of this copy of the workspace alone, as it reads them; empty where there are none."""
    return ConfigObj(str(workspace / ".dvc" / "config.local"), encoding="utf-8")


def write_settings(settings: ConfigObj) -> None:
    """Write them back whole: stages that run side by side read them."""
    path = Path(settings.filename)
    part = path.with_name(f"{path.name}.{os.getpid()}")
    with part.open("wb") as stream:
        settings.write(stream)
    part.replace(path)


def main() -> int:
    """Close this checkout's, for `make setup`."""
    return guarded(lambda: private_index(Path.cwd()))


if __name__ == "__main__":
    raise SystemExit(main())
