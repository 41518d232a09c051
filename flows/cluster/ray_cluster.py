"""The lab's standing Ray cluster: reached by its direct address, and checked before any stage starts.

python -m flows.cluster.ray_cluster [--workspace FOLDER]     # status 2 and one line for what is wrong
python -m flows.cluster.ray_cluster --wait HOST:PORT N       # until a cluster has N machines

Only this module and flows/cluster/away.py import Ray, and only where lab.yaml has a section `ray`.
"""

import argparse
import contextlib
import importlib
import os
import socket
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from bumblebee import DISTRIBUTION
from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from bumblebee.last_line import guarded
from flows import gpus
from flows.cluster import node
from tasks.lab.servers import AUTO, CLUSTER, FILE, RayLab, read_lab
from tasks.settings import params

ANSWER = 10  # [s] within which the cluster's head must
JOIN, LOOK_EVERY = 180.0, 2.0  # [s] within which the machines of an allocation must, and between two looks
LOOK = 120  # [s] within which every machine must; the first process on one takes some
PACKAGES = ("dvc", "mlflow", "mujoco", "numpy", "rsl-rl-lib", "scikit-learn", "scipy", "torch", DISTRIBUTION)
"""Packages that decide results. The code of bumblebee travels: a machine may lack it, but have no other version."""
GIB = 2**30  # [bytes]
MODULES = {"s3": "dvc_s3", "ssh": "dvc_ssh"}  # of DVC, by the scheme of the remote


def connect(own: RayLab, where: str) -> Any:
    """The module `ray`, connected to the cluster.

    Raises:
        BadInput: when Ray is not installed, nothing answers, or the cluster refuses this process.
    """
    if find_spec("ray") is None:
        raise BadInput(where, "the package ray", "none", "In the checkout: pip install -e '.[lab]'")
    own = replace(own, address=address_of(own, where))
    host, _, port = own.address.rpartition(":")
    try:
        socket.create_connection((host, int(port)), timeout=ANSWER).close()
    except OSError as error:
        do = "Is `ray start --head` running there?"
        raise BadInput(
            f"{where}.address", f"a Ray cluster at {own.address}", str(error.strerror or error), do
        ) from None
    ray = importlib.import_module("ray")
    try:
        with _quiet():
            ray.init(address=own.address, log_to_driver=False, logging_level="ERROR")
    except Exception as error:  # Ray raises RuntimeError, ConnectionError and errors of its own
        raise _refused(own, where, " ".join(str(error).split())) from None
    return ray


def address_of(own: RayLab, where: str) -> str:
    """`HOST:PORT` of the cluster's head.

    Raises:
        BadInput: for `auto` where the variable RAY_ADDRESS says nothing of that form.
    """
    if own.address != AUTO:
        return own.address
    found = os.environ.get("RAY_ADDRESS", "")
    if not CLUSTER.fullmatch(found):
        do = "Start the loop in the allocation (docs/lab/ray.sbatch), or state the address."
        raise BadInput(f"{where}.address", "HOST:PORT in the variable RAY_ADDRESS", found[:80] or "none", do)
    return found


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Drop what Ray's own code prints for each second in which the cluster refuses us; the error says it once."""
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _refused(own: RayLab, where: str, text: str) -> BadInput:
    if "ersion mismatch" in text:
        do = "Install the same versions everywhere."
        return BadInput(where, "the versions of Ray and Python that this process has", text[:300], do)
    do = f"This machine must belong to it (ray start --address={own.address}) and have its token in ~/.ray/auth_token."
    return BadInput(f"{where}.address", f"to join {own.address}", text[:200], do)


@dataclass(frozen=True)
class Need:
    """Demand of a stage on one machine beside a CPU slot."""

    gpus: int = 0
    memory: float = 0.0
    """[GiB]"""

    @property
    def options(self) -> dict[str, float]:
        """As Ray takes it."""
        found: dict[str, float] = {"num_cpus": 1, "num_gpus": self.gpus}
        return found | ({"memory": int(self.memory * GIB)} if self.memory else {})


def need(own: RayLab, content: Mapping[str, Any], kind: str, sections: Iterable[str]) -> Need:
    """Demand of a stage, by its name without cluster and round and the sections of `content` that it reads."""
    return Need(gpus.wanted(content, sections), own.memory.get(kind, 0.0))


def require_room(ray: Any, wanted: Need, name: str) -> None:
    """Refuse a stage for which no machine that is up has all that it needs, or a free CPU slot at all.

    Args:
        ray: the connected module.
        wanted: by the stage.
        name: of the setting that wants it.
    """
    up = [found["Resources"] for found in ray.nodes() if found["Alive"] and found["Resources"].get("CPU", 0) >= 1]
    if not up:
        raise BadInput(name, "a machine of the Ray cluster with a CPU slot", "none", "ray start --address=... on one")
    do = "Add a machine that has them, or ask for fewer."
    most = max(int(each.get("GPU", 0)) for each in up)
    if wanted.gpus > most:
        raise BadInput(name, f"at most {most} GPUs, which one machine of the Ray cluster has", str(wanted.gpus), do)
    room = max(each.get("memory", 0) for each in up if each.get("GPU", 0) >= wanted.gpus) / GIB
    if wanted.memory > room:
        beside = f" beside {wanted.gpus} GPUs" if wanted.gpus else ""
        expected = f"at most {room:.1f} GiB, which one machine of the Ray cluster gives{beside}"
        do = "Add a machine that has them, state more at its `ray start --memory=BYTES`, or ask for fewer."
        raise BadInput(name, expected, f"{wanted.memory:g}", do)


def check(workspace: Path) -> None:
    """Look at every machine of the cluster; does nothing where lab.yaml names none.

    Raises:
        BadInput: naming the first fault.
    """
    lab = read_lab(workspace)
    if lab is None or lab.ray is None:
        return
    where = f"{workspace / FILE}: ray"
    ray = connect(lab.ray, where)
    content = params.read(workspace / "params.yaml")
    for name in content:
        require_room(ray, Need(gpus.wanted(content, [name])), f"{workspace / 'params.yaml'}: {name}.gpus")
    stages = read_yaml(workspace / "dvc.yaml")["stages"]
    for kind in lab.ray.memory:
        if kind not in stages:
            raise BadInput(f"{where}.memory", f"stages of dvc.yaml: {', '.join(stages)}", kind)
        wanted = need(lab.ray, content, kind, stages[kind].get("params", []))
        require_room(ray, wanted, f"{where}.memory.{kind}")
    for machine in _facts(ray, lab.ray):
        _compare(machine, where)


def _facts(ray: Any, own: RayLab) -> list[dict[str, str]]:
    """Facts of the machines with a CPU slot, and first of this one."""
    at = importlib.import_module("ray.util.scheduling_strategies").NodeAffinitySchedulingStrategy
    importlib.import_module("ray.cloudpickle").register_pickle_by_value(node)
    scheme, _, _ = own.remote.partition("://")
    asked = (PACKAGES, own.remote if own.remote.startswith("/") else "", MODULES.get(scheme, ""))
    ask = ray.remote(num_cpus=0, max_retries=0)(node.facts)
    ids = [found["NodeID"] for found in ray.nodes() if found["Alive"] and found["Resources"].get("CPU", 0) >= 1]
    answers = [ask.options(scheduling_strategy=at(each, soft=False)).remote(*asked) for each in ids]
    try:
        return [node.facts(*asked), *ray.get(answers, timeout=LOOK)]
    except Exception as error:
        first = (str(error).strip().splitlines() or [type(error).__name__])[0]
        raise BadInput(own.address, "every machine of the Ray cluster to answer", first[:200]) from None


def _compare(machine: Mapping[str, str], where: str) -> None:
    here = node.facts(PACKAGES, "", "")
    for name in ("Python", *PACKAGES):
        if machine[name] != here[name] and not (name == DISTRIBUTION and not machine[name]):
            came = f"{machine[name] or 'none'} on {machine['host']}"
            raise BadInput(
                where, f"{name} {here[name]} on every machine", came, "Install the same versions everywhere."
            )
    if machine["fault"]:
        raise BadInput(f"{where}.remote", f"DVC's remote to be usable on {machine['host']}", machine["fault"])


def wait_for(address: str, machines: int) -> None:
    """Return when so many machines with a CPU slot belong to the cluster.

    Raises:
        BadInput: when they do not within `JOIN` seconds.
    """
    end, up = time.monotonic() + JOIN, 0
    while up < machines:
        try:
            ray = connect(RayLab(address, ""), "ray")
        except BadInput:
            if time.monotonic() > end:
                raise
        else:
            up = sum(bool(node["Alive"] and node["Resources"].get("CPU")) for node in ray.nodes())
            ray.shutdown()
        if up < machines:
            if time.monotonic() > end:
                raise BadInput(address, f"{machines} machines with a CPU slot in the Ray cluster", str(up))
            time.sleep(LOOK_EVERY)


def main(argv: list[str] | None = None) -> int:
    """Check, or wait; returns the exit status."""
    made = argparse.ArgumentParser(
        prog="python -m flows.cluster.ray_cluster", description="Check the lab's Ray cluster."
    )
    made.add_argument("--workspace", type=Path, default=Path("."), help="folder with lab.yaml (default: this one)")
    made.add_argument("--wait", nargs=2, metavar=("HOST:PORT", "N"), help="until this cluster has N machines")
    options = made.parse_args(argv)
    if options.wait:
        address, number = options.wait
        if not CLUSTER.fullmatch(address) or not number.isdigit():
            made.error(f"--wait: expected HOST:PORT and a number, came {address} {number}")
        return guarded(lambda: wait_for(address, int(number)))
    return guarded(lambda: check(options.workspace))


if __name__ == "__main__":
    sys.exit(main())
