"""A workspace: a folder with its own dvc.yaml, params.yaml, data, models and servers, using this checkout's code."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

import bumblebee
from bumblebee.errors import BadInput
from bumblebee.io.write import new_folder
from bumblebee.robot.which import FILE, SHIPPED, path_of
from flows.environment import environment
from tasks.lab.private import private_index
from tasks.lab.servers import FILE as LAB
from tasks.running import paths
from tasks.settings import params
from tasks.settings.filter_files import files_named

HOME = Path(bumblebee.__file__).resolve().parent.parent  # the folder with dvc.yaml, params.yaml and the packages
CODE = ("bumblebee", "tasks", "flows")
FIELD_BASE = "none"  # who brings motions has, on the robot, odometry to act on and no motion capture to log
POLICY = ("policy.pt", "card.json")  # files of a policy that a loop goes on from
_RAW = paths.RAW.parts
GENERATED = ".params.generated.yaml"  # what params.yaml was when it was last made here


def merge(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """`base` with the values of `over`; sections merge, everything else is replaced."""
    merged = dict(base)
    for key, value in over.items():
        old = merged.get(key)
        merged[key] = merge(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return merged


def create(
    folder: Path,
    profile: str | None = None,
    motions: Path | None = None,
    robot: str = "",
    policy: Path | None = None,
    **over: Any,
) -> Path:
    """Make `folder` a workspace, or bring an existing one up to date; its data, models and history stay.

    A params.yaml that was edited here stays as it is, but for what the call itself asks for.

    Args:
        folder: where; made if it is not there.
        profile: the name of a file in profiles/ whose values replace those of params.yaml.
        motions: a folder of motion files to use in place of the embedded ones.
        robot: a robot that comes along, or a robot's folder, in place of the one that is there or of the checkout's.
        policy: a policy of `bumblebee train` to begin from, in place of those that come along; nothing trains before
            the refinement but what the settings ask for.
        over: further sections of params.yaml to replace.

    Raises:
        BadInput: for an unknown profile, a missing folder of motions or of a policy.
    """
    content, edited = settings_of(folder, profile)
    if motions is not None:
        source = motions.expanduser().resolve()
        if not source.is_dir():
            raise BadInput(source, "a folder of motion files", "no such folder", "Check MOTIONS.")
        content = merge(content, {"motions": {"source": str(source)}})
        content = merge({"rollouts": {"base": FIELD_BASE}}, content)  # unless the settings say otherwise
    brought = _policy_files(policy) if policy is not None else {}
    if brought:
        content = merge(content, {"base": {"init": "own", "learner": "none"}})
    content = merge(content, over)
    folder.mkdir(parents=True, exist_ok=True)
    for name in CODE:
        _link(folder / name, HOME / name)
    _write(folder / ".dvcignore", (HOME / ".dvcignore").read_text())
    if (HOME / LAB).exists() and not (folder / LAB).exists():
        _write(folder / LAB, (HOME / LAB).read_text())
    _write(folder / "dvc.yaml", stages_with(folders_of(content), [file for _, file in files_named(content)]))
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    if edited is None or content != edited:
        _write(folder / "params.yaml", text)
    if edited is None:
        _write(folder / GENERATED, text)
    _write_robot(folder / paths.ROBOT, robot)
    for place in (paths.INCOMING, paths.RAW, paths.POLICY):
        (folder / place).mkdir(parents=True, exist_ok=True)
        _write(folder / place / "README.md", (HOME / place / "README.md").read_text())
    if brought:
        _fill(folder / paths.POLICY, brought)
    if not (folder / ".dvc" / "config").exists():
        init = [sys.executable, "-m", "dvc", "init", "--no-scm", "-q"]
        subprocess.run(init, cwd=folder, env=environment(folder), check=True)
        settings = (HOME / ".dvc" / "config").read_text()
        _write(folder / ".dvc" / "config", settings.replace("[core]\n", "[core]\n    no_scm = True\n"))
    private_index(folder)
    return folder


def _policy_files(policy: Path) -> dict[str, bytes]:
    """Content of a workspace's data/policy by name.

    Raises:
        BadInput: no policy in the folder.
    """
    policy = policy.expanduser()
    if not (policy / POLICY[0]).is_file():
        raise BadInput(policy, f"a policy of `bumblebee train` ({POLICY[0]})", "none", "Check POLICY.")
    found = [HOME / paths.POLICY / "README.md", *(policy / name for name in POLICY if (policy / name).is_file())]
    return {file.name: file.read_bytes() for file in found}


def _write_robot(place: Path, robot: str) -> None:
    """The workspace's robot: what is asked for, else what is there, else the checkout's."""
    if robot:
        source = path_of(robot)
        from bumblebee.robot.folder import read_folder  # with MuJoCo, which no other workspace needs

        read_folder(source)
        if source.parent == SHIPPED:
            files = {FILE: f"like: {source.stem}\n".encode()}
        else:
            files = {file.name: file.read_bytes() for file in sorted(source.parent.iterdir()) if file.is_file()}
    elif (place / FILE).is_file():
        return
    else:
        files = {file.name: file.read_bytes() for file in (HOME / paths.ROBOT).iterdir()}
    _fill(place, files)


def _fill(place: Path, files: dict[str, bytes]) -> None:
    """Let a folder hold these files and no other, put there together; where it does already it stays untouched."""
    there = {file.name: file.read_bytes() for file in place.iterdir()} if place.is_dir() else {}
    if there != files:
        with new_folder(place) as fresh:
            for name, content in files.items():
                (fresh / name).write_bytes(content)


def settings_of(folder: Path, profile: str | None) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """Settings that params.yaml starts from: (settings, the edited ones in `folder` if somebody edited them there)."""
    here, generated = folder / "params.yaml", folder / GENERATED
    made = here.is_file() and generated.is_file() and here.read_bytes() == generated.read_bytes()
    if here.exists() and not made:
        edited = params.read(here)
        print(f"{here} was edited: it is kept (remove it to start from the checkout's again)", file=sys.stderr)
        return edited, edited
    content = params.read(HOME / "params.yaml")
    return (merge(content, params.read(profile_path(profile))) if profile else content), None


def folders_of(content: dict[str, Any]) -> list[Path]:
    """The user's motions and texts outside data/raw; not what `tasks.sections` refuses before the first stage."""
    section = content.get("motions")
    section = section if isinstance(section, dict) else {}
    read = section.get("read")
    texts = read.get("describe") if isinstance(read, dict) else None
    named = [
        section.get("source"),
        read.get("skeleton") if isinstance(read, dict) else None,
        *(
            (texts.get(key) for key in ("captions_folder", "captions_csv", "humanml3d"))
            if isinstance(texts, dict)
            else ()
        ),
    ]
    found = []
    for text in named:
        if isinstance(text, str) and text.isprintable() and text not in ("", "embedded"):
            with contextlib.suppress(RuntimeError):  # the home of nobody
                found.append(Path(text).expanduser())
    return [folder for folder in found if folder.is_absolute() or folder.parts[: len(_RAW)] != _RAW]


def stages_with(folders: Sequence[Path], of_filter: Sequence[str] = ()) -> str:
    """dvc.yaml, in which the user's folders and files are dependencies, too, so that what is new there makes stale.

    Args:
        folders: read by the stage motions.
        of_filter: files and folders that the section filter names, as they stand there.
    """
    text = (HOME / "dvc.yaml").read_text()
    if not folders and not of_filter:
        return text
    pipeline = yaml.safe_load(text)
    deps = pipeline["stages"]["motions"]["deps"]
    deps += [path for path in dict.fromkeys(str(folder.resolve()) for folder in folders) if path not in deps]
    pipeline["stages"]["filter"]["deps"] += of_filter
    return yaml.safe_dump(pipeline, sort_keys=False, width=120)


def profile_path(profile: str) -> Path:
    """The file of a profile."""
    path = HOME / "profiles" / f"{profile}.yaml"
    if not path.exists():
        known = ", ".join(sorted(file.stem for file in (HOME / "profiles").glob("*.yaml")))
        raise BadInput(path, f"one of the profiles {known}", profile)
    return path


def _link(link: Path, target: Path) -> None:
    wanted = os.path.relpath(target, link.parent.resolve())
    if link.is_symlink() and os.readlink(link) == wanted:
        return
    if link.is_symlink():
        link.unlink()
    if link.exists():
        raise BadInput(link, "a link to the code", "something else", "Choose another folder.")
    link.symlink_to(wanted)


def _write(path: Path, text: str) -> None:
    """Write only what differs, so that an unchanged workspace keeps its time stamps."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def named(name: str) -> Path:
    """The workspace called `name` under runs/; without a name this folder if it is one, else the checkout.

    Raises:
        BadInput: when there is none of that name.
    """
    if not name:
        here = Path.cwd()
        return here if (here / "dvc.yaml").exists() and (here / "params.yaml").exists() else HOME
    folder = HOME / "runs" / name
    if not (folder / "dvc.yaml").exists():
        known = ", ".join(sorted(path.parent.name for path in folder.parent.glob("*/dvc.yaml"))) or "none yet"
        raise BadInput(folder, "a workspace", "no such folder", f"Workspaces: {known}.")
    return folder
