"""A stage in a work tree of its own on a cluster's machine: `python -m flows.cluster.away_stage STAGE [BEFORE ...]`.

Its inputs come from the shared remote, and what it made goes there, at last the entry of the run cache by which the
head writes it into the only dvc.lock that counts. So an entry that is there has its files. Meanwhile its checkpoints go
there, and the last one of a machine that was lost comes from there.
"""

import os
import sys
from pathlib import Path

from flows import reproduce
from flows.cluster import checkpoints
from flows.cluster.parcel import REMOTE
from flows.environment import environment
from tasks.lab.servers import read_lab
from tasks.running.parent import end_with_parent


def main(argv: list[str] | None = None) -> int:
    """Pull, reproduce, push; the exit status of the first that fails."""
    end_with_parent()
    name, *before = sys.argv[1:] if argv is None else argv
    variables = environment(Path.cwd())
    os.environ.clear()
    os.environ.update(variables)
    from dvc.cli import main as dvc

    if before and (status := int(dvc(["pull", "--quiet", "--force", "--remote", REMOTE, *before]))):
        return status
    lab = read_lab(Path.cwd())
    assert lab is not None and lab.ray is not None
    with checkpoints.kept(shelf(name), lab.ray.checkpoint_seconds):
        status = reproduce.main([name])
    if status:
        return status
    # Files first: whoever finds the run in the cache finds what it made.
    for words in ([], ["--run-cache"]):
        if status := int(dvc(["push", "--quiet", "--remote", REMOTE, *words, name])):
            return status
    return 0


def shelf(name: str) -> checkpoints.Shelf:
    """The place for the stage's checkpoints; its inputs are here."""
    from dvc.repo import Repo

    with Repo(_wait_for_lock=True) as repo, repo.lock:
        (stage,) = repo.stage.collect(name)
        stage.save_deps()
        return checkpoints.shelf_of(repo, stage)


if __name__ == "__main__":
    raise SystemExit(main())
