"""One stage on another machine of the lab: `python -m flows.cluster.away STAGE`, in place of flows.reproduce.

The head alone writes dvc.lock. A machine of the cluster pulls the stage's inputs, runs it in a work tree of its own and
pushes files and run cache; then `dvc repro` here finds the run in the cache and runs nothing. One process a stage, a
driver of Ray's: when it ends, also by a kill, Ray ends the stage. Why not prefect-ray: docs/decisions/stages-on-ray.md.
"""

import importlib
import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from configobj import ConfigObj

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from flows import reproduce
from flows.cluster import checkpoints, node, parcel, ray_cluster
from flows.stages import Stage, kind_of, read_stages
from tasks.lab.private import local_settings, write_settings
from tasks.lab.servers import FILE, Lab, read_lab
from tasks.running import lineage, lock_file
from tasks.running.parent import end_with_parent
from tasks.settings import params

TRIES = 3  # machines that may be lost under one stage
EXIT_LOST = 1
OUT_OF_MEMORY = "its machine ran out of memory; say in lab.yaml what it needs: ray: {{memory: {{{kind}: GIB}}}}"


@dataclass(frozen=True)
class Errand:
    """Facts of a stage before it goes anywhere."""

    name: str
    """As DVC calls it."""
    before: tuple[str, ...]
    """All stages that it needs, directly or not."""
    inputs: tuple[str, ...]
    """Paths that no stage makes and that travel with it."""
    sections: tuple[str, ...]
    """Sections of params.yaml that it reads."""
    stays: str
    """Why it runs on the head; "" for a stage that may go anywhere."""


def ancestors(stages: Iterable[Stage], name: str) -> tuple[str, ...]:
    """Names of all stages that the stage `name` needs, directly or not; without the sets of data/raw."""
    known = {stage.name: stage for stage in stages}
    found: set[str] = set()
    waiting = [name]
    while waiting:
        new = known[waiting.pop()].needs - found
        found |= new
        waiting += new
    return tuple(sorted(each for each in found if not each.endswith(".dvc")))


def errand(workspace: Path, name: str) -> Errand:
    """Facts of the stage, by DVC.

    Raises:
        BadInput: for dvc.yaml that DVC cannot read.
    """
    from dvc.dependency.param import ParamsDependency
    from dvc.repo import Repo

    before = ancestors(read_stages(workspace), name)
    with Repo(str(workspace)) as repo:
        (stage,) = repo.stage.collect(name)
        paths = [str(dep.def_path) for dep in stage.deps if not isinstance(dep, ParamsDependency)]
        sections = [each for dep in stage.deps if isinstance(dep, ParamsDependency) for each in dep.params]
        made = [os.path.relpath(out.fs_path, workspace) for out in repo.index.outs]
        kept = [str(out.def_path) for out in stage.outs if out.persist]
    inputs = tuple(parcel.plain_inputs(paths, made))
    stays = "" if not kept else f"it goes on from its last {kept[0]}"
    if outside := [path for path in inputs if os.path.isabs(path) or path.startswith("..")]:
        stays = f"it reads {outside[0]}"
    elif not stays and parcel.size(workspace, inputs) > parcel.LIMIT:
        stays = "its inputs are large and lie here"
    if kind_of(name) in ("gate", "publish"):
        stays = "its answers are kept here"
    return Errand(name, before, inputs, tuple(sections), stays)


def recorded(name: str) -> bool:
    """Whether the shared run cache knows the stage with these inputs; then its files are here, its checkpoints gone."""
    from dvc.repo import Repo

    with Repo(_wait_for_lock=True) as repo, repo.lock:
        (stage,) = repo.stage.collect(name)
        cache = repo.stage_cache
        shared = repo.cloud.get_remote_odb(parcel.REMOTE, "fetch --run-cache", hash_name="md5-dos2unix")
        cache.transfer(shared, repo.cache.legacy, force=False)
        stage.save_deps()
        entry = cache._load(stage)
        if entry is None:
            return False
        for objects in cache._create_stage(entry, wdir=stage.wdir).get_used_objs().values():
            repo.cloud.pull(objects, remote=parcel.REMOTE)
        checkpoints.shelf_of(repo, stage).clear()
        return True


def settle(lab: Lab) -> None:
    """Make the shared remote the workspace's default, so that `dvc pull` and `dvc push` mean it."""
    settings, own = local_settings(Path.cwd()), ConfigObj(parcel.dvc_settings(lab).splitlines())
    del own["core"]["no_scm"]
    (section,) = set(own) - {"core"}
    url = settings.get(section, {}).get("url")
    if url is None:
        settings.merge(own)
        write_settings(settings)
    elif url != own[section]["url"]:
        do = f"Remove it, or give it the remote `{parcel.REMOTE}` with that url."
        raise BadInput(settings.filename, f"url = {own[section]['url']}", "another remote", do)


def send(ray: Any, what: Errand, lab: Lab, wanted: ray_cluster.Need) -> int | None:
    """Run the stage on whichever machine is free, and repeat what it prints; its status, None for a lost machine."""
    from dvc.repo import Repo

    with Repo(_wait_for_lock=True) as repo, repo.lock:
        packed = parcel.pack(Path.cwd(), what.inputs, parcel.dvc_settings(lab))
    words = ["flows.cluster.away_stage", what.name, *what.before]
    variables = {lineage.COMMIT: lineage.git_sha(), lineage.PLACE: lineage.place()}
    importlib.import_module("ray.cloudpickle").register_pickle_by_value(node)
    task = ray.remote(**wanted.options, max_retries=0, scheduling_strategy="SPREAD")(node.run)
    errors = ray.exceptions
    status: int | None = None
    try:
        for item in task.remote(packed, Path.cwd().name, words, variables):
            said = ray.get(item)
            if isinstance(said, int):
                status = said
            else:
                print(said, flush=True)
    except (errors.NodeDiedError, errors.WorkerCrashedError, errors.LocalRayletDiedError, errors.ObjectLostError):
        return None
    except errors.OutOfMemoryError:
        print(f"{what.name}: {OUT_OF_MEMORY.format(kind=kind_of(what.name))}", file=sys.stderr)
        return EXIT_LOST
    except errors.RayTaskError as error:
        raise of_the_machine(error) from None
    return status


def of_the_machine(error: Exception) -> Exception:
    """Error of the other machine's disk, which the last line knows by its number; any other error as Ray tells it."""
    cause = getattr(error, "cause", None)
    return cause if isinstance(cause, OSError) else error


def bring(name: str) -> int:
    """Bring the stage up to date, here or elsewhere; DVC's exit status.

    Raises:
        BadInput: for a cluster that does not answer or has no room for the stage.
    """
    from dvc.cli import main as dvc

    workspace, lab = Path.cwd(), read_lab(Path.cwd())
    if lab is None or lab.ray is None:
        raise BadInput(workspace / FILE, "a section ray", "none", "python -m flows.reproduce runs a stage here.")
    lock_file.read_whole()
    settle(lab)
    what = errand(workspace, name)
    if what.stays:
        print(f"{name} runs on this machine: {what.stays}", flush=True)
        return reproduce.main([name])
    if not dvc(["--wait-for-lock", "status", "--quiet", name]):
        return reproduce.main([name])  # it says so
    for _ in range(TRIES):
        if recorded(name):
            return reproduce.main([name])
        if what.before and (status := dvc(["--wait-for-lock", "push", "-q", "-r", parcel.REMOTE, *what.before])):
            return int(status)
        ray = ray_cluster.connect(lab.ray, f"{workspace / FILE}: ray")
        wanted = ray_cluster.need(lab.ray, params.read(), kind_of(name), what.sections)
        ray_cluster.require_room(ray, wanted, f"{workspace / 'params.yaml'}: {name}")
        status = send(ray, what, lab, wanted)
        ray.shutdown()
        if status:
            return status
        if status is None:
            print(f"{name}: its machine was lost; another one goes on from its last checkpoint", flush=True)
        elif not recorded(name):
            print(
                f"{name}: ran elsewhere, with inputs or code that have changed here since: run again", file=sys.stderr
            )
            return EXIT_LOST
    if recorded(name):
        return reproduce.main([name])
    print(f"{name}: {TRIES} machines were lost under it, one after the other", file=sys.stderr)
    return EXIT_LOST


def main(argv: list[str] | None = None) -> int:
    """Bring one stage up to date; 2 for bad input."""
    end_with_parent()
    (name,) = sys.argv[1:] if argv is None else argv
    return guarded(lambda: bring(name))


if __name__ == "__main__":
    raise SystemExit(main())
