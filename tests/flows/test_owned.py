"""A workspace is run only where nobody but its owner decides what runs."""

import os
import shlex
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from bumblebee.errors import BadInput
from flows import owned
from flows import workspace as workspaces
from tasks.lab.private import INDEX

NOBODY = 65534


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("SUDO_UID", raising=False)
    made = tmp_path / "my lab"
    (made / ".dvc").mkdir(parents=True)
    (made / "dvc.yaml").write_text("stages: {}\n")
    (made / ".dvc" / "config").touch()
    owned.require_own(made)
    return made


def refused(folder: Path, path: Path, who: str) -> str:
    """The remedy; it is carried out, and the workspace is accepted afterwards."""
    with pytest.raises(
        BadInput, match=f"a workspace that only you can change, came one that {who} can write"
    ) as caught:
        owned.require_own(folder)
    assert caught.value.where == str(path)
    subprocess.run(shlex.split(caught.value.do), check=True)
    owned.require_own(folder)
    return caught.value.do


@pytest.mark.parametrize("name", ["", "dvc.yaml", ".dvc", ".dvc/config"])
def test_what_everybody_can_write_is_refused(folder: Path, name: str):
    (folder / name).chmod((folder / name).stat().st_mode | stat.S_IWOTH)
    refused(folder, folder / name, "everybody")


def test_one_command_closes_all_that_is_open(folder: Path):
    for name in ("dvc.yaml", ".dvc/config"):
        (folder / name).chmod(0o666)
    with pytest.raises(BadInput) as caught:
        owned.require_own(folder)
    subprocess.run(shlex.split(caught.value.do), check=True)
    owned.require_own(folder)


def test_a_group_may_write_only_while_nobody_else_is_in_it(folder: Path, monkeypatch: pytest.MonkeyPatch):
    me, members = owned.pwd.getpwuid(os.geteuid()).pw_name, []
    group = SimpleNamespace(gr_name=me, gr_mem=members)
    monkeypatch.setattr(owned.grp, "getgrgid", lambda number: group)
    (folder / "dvc.yaml").chmod(0o664)
    owned.require_own(folder)  # as git leaves it where each user has a group of their own
    members.append(me)
    owned.require_own(folder)
    members.append("mallory")
    refused(folder, folder / "dvc.yaml", "its group")
    (folder / "dvc.yaml").chmod(0o664)
    members.clear()
    group.gr_name = "users"
    refused(folder, folder / "dvc.yaml", "its group")
    (folder / "dvc.yaml").chmod(0o664)
    group.gr_name = me
    monkeypatch.setattr(owned.os, "listxattr", lambda path: [owned.ACL], raising=False)
    refused(folder, folder / "dvc.yaml", "its group")


def test_a_link_into_a_folder_of_everybody_is_refused(folder: Path, tmp_path: Path):
    """Whoever may write there may replace the file, and whoever may write on the way a link or a folder."""
    shared = tmp_path / "shared"
    (shared / "deep").mkdir(parents=True)
    (folder / "dvc.yaml").rename(shared / "deep" / "dvc.yaml")
    (tmp_path / "way").symlink_to("shared")
    (folder / "dvc.yaml").symlink_to(tmp_path / "way" / "deep" / "dvc.yaml")
    owned.require_own(folder)
    shared.chmod(0o777)
    refused(folder, shared, "everybody")
    shared.chmod(0o1777)
    owned.require_own(folder)  # as /tmp: nobody else can replace what is mine


def test_a_folder_above_that_everybody_can_write_is_refused(folder: Path):
    folder.parent.chmod(0o777)
    refused(folder, folder.parent, "everybody")


def test_a_loop_of_links_ends(folder: Path):
    (folder / "params.yaml").symlink_to("params.yaml")
    owned.require_own(folder)


def test_what_another_user_owns_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch):
    real = Path.lstat
    theirs = SimpleNamespace(st_uid=NOBODY, st_mode=0o100644)
    monkeypatch.setattr(owned.Path, "lstat", lambda path: theirs if path.name == "dvc.yaml" else real(path))
    with pytest.raises(BadInput, match=f"dvc.yaml: expected a workspace of your own, came one that user {NOBODY} owns"):
        owned.require_own(folder)


def test_a_workspace_that_is_made_under_any_umask_is_ones_own(tmp_path: Path):
    """By a command; nothing of what it makes may be changed by others."""
    code = "import sys; from pathlib import Path; from bumblebee.last_line import guarded; from flows import owned"
    code += ", workspace; made = Path(sys.argv[1]); guarded(lambda: (workspace.create(made), 0)[1]); "
    code += "owned.require_own(made)"
    command = f"umask 000; exec {shlex.join([sys.executable, '-c', code, str(tmp_path / 'lab')])}"
    subprocess.run(["/bin/sh", "-c", command], cwd=workspaces.HOME, check=True)
    index = tmp_path / "lab" / INDEX
    made = [path for path in (tmp_path / "lab").rglob("*") if not path.is_symlink() and index not in path.parents]
    assert [path for path in made if path.stat().st_mode & 0o022] == []
    assert tmp_path / "lab" / "dvc.yaml" in made
