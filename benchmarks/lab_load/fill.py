"""Fifty runs of the loop on a lab's servers, with 10,000 records of stages in both histories."""

import asyncio
import random
import time
from pathlib import Path
from typing import Any

import aiohttp

from benchmarks.lab_load.users import Arm
from tasks import registry

STAGES = ("motions", "filter", "cluster", "base", "experts", "rollouts", "delta", "refine", "evaluate", "publish")
MODELS = tuple(f"expert-c{number}" for number in range(5))
POLICY = "policy/policy.onnx"
BYTES = 2**20  # of a policy: a network of 512, 256 and 128 units has 1.2 MB
PARAMS, METRICS = 30, 8  # of a stage's record
AT_ONCE = 8  # requests to Prefect while it is filled
NOW = {"type": "COMPLETED", "name": "Completed"}


def mlflow(folder: Path, loops: int, stages: int) -> None:
    """Records by MLflow's client, straight into database and store as stages write them.

    Args:
        folder: the workspace, which must be the current folder.
        loops: each with one record that has files, written by `registry.log_run`, and a model's version with an alias.
        stages: records of each loop.
    """
    from mlflow.entities import Metric, Param, RunTag

    client, draw = registry.prepare(), random.Random(0)
    experiment = client.get_experiment_by_name(registry.experiment_name())
    assert experiment is not None
    (policy := Path("policy")).mkdir()
    for name in MODELS:
        client.create_registered_model(name)
    for loop in range(loops):
        (policy / "policy.onnx").write_bytes(draw.randbytes(BYTES))
        settings, numbers = {f"key{n}": draw.random() for n in range(PARAMS)}, {"success": draw.random()}
        run = registry.log_run("experts", "c0", 1, settings, numbers, None, {"loop": str(loop)}, [policy])
        model = MODELS[loop % len(MODELS)]
        made = client.create_model_version(model, f"{client.get_run(run).info.artifact_uri}/policy", run)
        client.set_registered_model_alias(model, "champion", made.version)
        for number in range(stages - 1):
            kind = STAGES[number % len(STAGES)]
            tags = {"stage": kind, "cluster": f"c{number % 6}", "loop": str(loop), "git_sha": draw.randbytes(20).hex()}
            record = client.create_run(experiment.experiment_id, run_name=f"{kind} c{number % 6} r1", tags=tags)
            now = int(1000 * time.time())
            client.log_batch(
                record.info.run_id,
                metrics=[Metric(f"metric{n}", draw.random(), now, 0) for n in range(METRICS)],
                params=[Param(f"key{n}", str(draw.random())) for n in range(PARAMS)],
                tags=[RunTag("lineage", draw.randbytes(32).hex())],
            )
            client.set_terminated(record.info.run_id)


async def prefect(arm: Arm, loops: int, stages: int) -> None:
    """Runs of the flow and of its stages by Prefect's interface."""
    limit = asyncio.Semaphore(AT_ONCE)
    async with aiohttp.ClientSession(headers=arm.headers) as session:

        async def post(what: str, body: dict[str, Any]) -> dict[str, Any]:
            async with limit, session.post(f"{arm.prefect}/api/{what}", json=body) as reply:
                assert reply.status in (200, 201), f"{what}: {reply.status} {await reply.text()}"
                return await reply.json()

        flow = await post("flows/", {"name": "loop"})
        made = [await post("flow_runs/", {"flow_id": flow["id"], "state": NOW}) for _ in range(loops)]
        for run in made:
            await asyncio.gather(*(post("task_runs/", stage(run["id"], number)) for number in range(stages)))


def stage(run: str, number: int) -> dict[str, Any]:
    """Record of a stage for Prefect."""
    kind = STAGES[number % len(STAGES)]
    return {
        "flow_run_id": run,
        "name": f"{kind} round 1 c{number % 6}",
        "task_key": "run_stage",
        "dynamic_key": str(number),
        "state": NOW,
    }
