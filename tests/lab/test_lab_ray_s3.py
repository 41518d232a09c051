"""DVC's remote in a bucket: stages of another machine, a loop that is killed in a training, and a colleague's pull."""

import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil
import pytest

from flows.cluster.checkpoints import FOLDER
from flows.environment import environment
from tests.lab.conftest import LabOnThisMachine, Stand
from tests.lab.loops import LIMIT, call, colleague, files, locked, only, workspace

LONG = {"base": {"ppo": {"iterations": 10, "checkpoint_every": 2}}}
STAGES = ("motions", "filter", "base")


def keys(lab: LabOnThisMachine, folder: str) -> list[str]:
    """Names of what lies below a folder of the bucket."""
    import boto3

    client = boto3.client("s3", endpoint_url=lab.store.endpoint, region_name="us-east-1")
    found = client.list_objects_v2(Bucket=lab.store.bucket, Prefix=f"{folder}/")
    return [entry["Key"] for entry in found.get("Contents", [])]


def kill_with_a_checkpoint(run: "subprocess.Popen[Any]", lab: LabOnThisMachine) -> None:
    """Wait until the bucket has a checkpoint, and end the loop with all its processes on the head."""
    end = time.monotonic() + LIMIT
    while time.monotonic() < end and run.poll() is None:
        if keys(lab, f"dvc/{FOLDER}"):
            root = psutil.Process(run.pid)
            for each in [root, *root.children(recursive=True)]:
                os.kill(each.pid, signal.SIGKILL)
            run.wait()
            return
        time.sleep(0.2)
    raise AssertionError(f"a checkpoint in the bucket: never; the run's status is {run.poll()}")


def test_a_killed_loop_goes_on_from_the_bucket_and_ends_as_on_one_machine(
    lab: LabOnThisMachine, stand: Stand, tmp_path: Path
) -> None:
    if find_spec("dvc_s3") is None:
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)("no package dvc-s3")
    (tmp_path / "one").mkdir()
    one = only(workspace(tmp_path / "one", None, **LONG), *STAGES)
    alone = call(one, "-m", "dvc", "repro", "-q")
    assert alone.returncode == 0, alone.stdout + alone.stderr
    remote = f"s3://{lab.store.bucket}/dvc"
    made = only(
        workspace(tmp_path, {**stand.content, "ray": {**stand.content["ray"], "remote": remote}}, **LONG), *STAGES
    )
    words = ["-m", "flows.demo", "--verbose", "--workspace", "."]
    with (tmp_path / "said").open("w") as said:
        run = subprocess.Popen([sys.executable, *words], cwd=made, env=environment(made), stdout=said, stderr=said)
        kill_with_a_checkpoint(run, lab)
    again = call(made, *words)
    assert again.returncode == 0, (tmp_path / "said").read_text()[-3000:] + again.stdout + again.stderr
    assert "base: goes on after iteration" in again.stdout + again.stderr
    assert locked(made) == locked(one) and files(made) == files(one)
    assert not keys(lab, f"dvc/{FOLDER}") and keys(lab, "dvc/runs") and keys(lab, "dvc/files/md5")
    assert files(colleague(tmp_path / "other", made)) == files(made)
