"""docs/lab/ray.sbatch without Slurm: `scontrol` and `srun` are stand-ins; the cluster that it starts is a real one."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

from flows.workspace import HOME
from tests.lab import cluster as clusters

SCRIPT = HOME / "docs" / "lab" / "ray.sbatch"
LIMIT = 300  # [s]
SCONTROL = """#!/bin/bash
[ "$*" = "show hostnames node[1-3]" ] || { echo "scontrol $*: not asked for the nodes" >&2; exit 1; }
printf 'node1\\nnode2\\nnode3\\n'
"""
# As many tasks as it is asked for, each in a session of its own as on another machine; ends with all of them.
SRUN = """#!/bin/bash
echo "$*" >> "$SAID/srun"
tasks=0
while [ "${1:0:2}" = -- ]; do case $1 in --ntasks=*) tasks=${1#*=};; esac; shift; done
trap 'kill $(jobs -p)' TERM
for _ in $(seq "$tasks"); do setsid "$@" & sleep "$APART"; done
while [ -n "$(jobs -pr)" ]; do wait; done
"""
# A Python that says what it is asked for, and is a node of Ray until it is ended.
PYTHON = """#!/bin/bash
case "$*" in
*token_hex*) printf 'a-token';;
*get_node_ip_address*) echo 10.0.0.1;;
*ray.scripts*) echo "$RAY_AUTH_MODE $(cat "$RAY_AUTH_TOKEN_PATH") $*" >> "$SAID/ray"; exec tail -f /dev/null;;
*--wait*) until [ "$(wc -l < "$SAID/ray")" -ge "${@: -1}" ]; do :; done; echo "$*" >> "$SAID/waited";;
esac
"""


@dataclass(frozen=True)
class Job:
    """An allocation of three nodes."""

    folder: Path
    variables: dict[str, str]

    def start(self, *command: str, **over: str) -> "subprocess.Popen[str]":
        return subprocess.Popen(
            ["bash", str(SCRIPT), *command],
            env={**self.variables, **over},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def said(self, name: str) -> list[str]:
        return (self.folder / "said" / name).read_text().splitlines()


@pytest.fixture
def job(tmp_path: Path) -> Iterator[Job]:
    programs = {"scontrol": SCONTROL, "srun": SRUN, "python": PYTHON}
    for name in ("bin", "said", "home", "submit"):
        (tmp_path / name).mkdir()
    for name, text in programs.items():
        (tmp_path / "bin" / name).write_text(text)
        (tmp_path / "bin" / name).chmod(0o755)
    own = {"SLURM_JOB_ID": "17", "SLURM_SUBMIT_DIR": str(tmp_path / "submit"), "SLURM_JOB_NODELIST": "node[1-3]"}
    path = f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"
    own |= {"HOME": str(tmp_path / "home"), "PATH": path, "SAID": str(tmp_path / "said"), "APART": "0"}
    yield Job(tmp_path, {**os.environ, **own, "PYTHON": str(tmp_path / "bin" / "python")})


def test_head_and_workers_get_the_jobs_token_and_the_loop_the_address(job: Job) -> None:
    loop = 'echo "$RAY_ADDRESS $RAY_AUTH_MODE $(stat -c %a "$RAY_AUTH_TOKEN_PATH") $BUMBLEBEE_NODE $PWD"; exit 3'
    run = job.start("bash", "-c", loop, TMPDIR="/scratch", SLOTS="2", RAY_PORT="7000")
    out, err = run.communicate(timeout=LIMIT)
    assert run.returncode == 3, err  # 3: a gate waits
    assert out.split() == ["10.0.0.1:7000", "token", "600", "/scratch/bumblebee-17", str(job.folder / "submit")]
    start = "token a-token -m ray.scripts.scripts start --block --num-cpus=2"
    head = f"{start} --head --node-ip-address=10.0.0.1 --port=7000 --include-dashboard=false"
    assert job.said("ray") == [head, *[f"{start} --address=10.0.0.1:7000"] * 2]
    (srun,) = job.said("srun")
    assert "--nodes=2 --ntasks=2 --ntasks-per-node=1 --exclude=node1" in srun
    assert job.said("waited")[-1] == "-m flows.cluster.ray_cluster --wait 10.0.0.1:7000 3"
    assert not list((job.folder / "home" / ".ray").iterdir())


def test_at_the_time_limit_the_loop_is_told_and_ends_before_its_cluster(job: Job) -> None:
    loop = "trap 'kill $!; echo ends in order; exit 5' TERM; echo up; tail -f /dev/null & wait"
    run = job.start("bash", "-c", loop)
    assert run.stdout is not None and run.stdout.readline() == "up\n"
    run.send_signal(signal.SIGTERM)
    out, err = run.communicate(timeout=LIMIT)
    assert (run.returncode, out) == (5, "ends in order\n"), err
    assert not list((job.folder / "home" / ".ray").iterdir())


def test_without_an_allocation_it_is_one_line(job: Job) -> None:
    variables = {name: value for name, value in job.variables.items() if not name.startswith("SLURM")}
    ended = subprocess.run(["bash", str(SCRIPT)], env=variables, capture_output=True, text=True, check=False)
    assert ended.returncode and "SLURM_JOB_ID: is not set: start this script by sbatch" in ended.stderr


def test_a_real_cluster_of_three_is_up_while_the_command_runs(job: Job) -> None:
    if find_spec("ray") is None:
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)("no package ray")
    look = "import os, ray; ray.init(os.environ['RAY_ADDRESS'], log_to_driver=False); print(len(ray.nodes()))"
    more = {"PYTHON": sys.executable, "RAY_PORT": str(clusters.port()), "SLOTS": "1", "APART": "8", **clusters.PATIENT}
    run = job.start(sys.executable, "-c", look, PYTHONPATH=str(HOME), **more)
    out, err = run.communicate(timeout=LIMIT)
    log = next((job.folder / "submit").glob("ray-*.log")).read_text()
    assert run.returncode == 0 and out.splitlines()[-1] == "3", err + log
