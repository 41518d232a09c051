"""A closed loop of users: each looks something up, reads for a while, looks up the next."""

import asyncio
import random
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import aiohttp

LIMIT = 30.0  # [s] after which an answer counts as none
IDLE = 2.0  # [s] after which a connection is not used again: the servers close theirs after 5, under a request's feet
API = "api/2.0/mlflow"


@dataclass(frozen=True)
class Known:
    """Objects that may be looked up."""

    experiment: str
    runs: Sequence[str]
    """Numbers of MLflow runs that have files."""
    file: str
    """Path of a file that each of them has."""
    models: Sequence[str]
    flow_runs: Sequence[str]


@dataclass(frozen=True)
class Arm:
    """A pair of servers."""

    name: str
    mlflow: str
    prefect: str
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Sample:
    """One look-up."""

    arm: str
    what: str
    seconds: float
    error: str
    """"" where it was answered."""


@dataclass(frozen=True)
class Request:
    """One of those that a look-up makes, one after the other."""

    server: str
    path: str
    body: Any = None
    """Sent as JSON by POST; None: GET."""


def look_ups(known: Known, draw: random.Random) -> dict[str, list[Request]]:
    """Requests of a page of each kind to its server."""
    run, model, flow_run = draw.choice(known.runs), draw.choice(known.models), draw.choice(known.flow_runs)
    page = {"experiment_ids": [known.experiment], "max_results": 100, "order_by": ["attributes.start_time DESC"]}
    of_run = {"flow_runs": {"id": {"any_": [flow_run]}}, "limit": 200, "sort": "EXPECTED_START_TIME_DESC"}
    stage = {**page, "filter": f"tags.stage = '{draw.choice(('base', 'experts', 'refine'))}'"}
    return {
        "model by its alias": [Request("mlflow", f"{API}/registered-models/alias?name={model}&alias=champion")],
        "list of 100 runs": [Request("mlflow", f"{API}/runs/search", page)],
        "runs of a stage": [Request("mlflow", f"{API}/runs/search", stage)],
        "a run's page": [
            Request("mlflow", f"{API}/runs/get?run_id={run}"),
            Request("mlflow", f"{API}/artifacts/list?run_id={run}"),
        ],
        "a policy of 1 MiB": [Request("mlflow", f"get-artifact?run_id={run}&path={known.file}")],
        "Prefect: list of runs": [
            Request("prefect", "api/flow_runs/paginate", {"sort": "START_TIME_DESC", "limit": 50}),
            Request("prefect", "api/flow_runs/count", {}),
        ],
        "Prefect: a run's 200 stages": [
            Request("prefect", f"api/flow_runs/{flow_run}"),
            Request("prefect", "api/task_runs/filter", of_run),
        ],
    }


async def seen(arm: Arm, experiment: str, file: str) -> Known:
    """Objects that the servers themselves list: runs with files are those that became versions of a model.

    Args:
        arm: the servers.
        experiment: name of MLflow's experiment.
        file: that each of these runs has.
    """
    async with aiohttp.ClientSession(headers=arm.headers) as session:

        async def answer(address: str, body: Any = None) -> Any:
            way = "GET" if body is None else "POST"
            async with session.request(way, address, json=body, raise_for_status=True) as reply:
                return await reply.json()

        own = await answer(f"{arm.mlflow}/{API}/experiments/get-by-name?experiment_name={experiment}")
        versions = (await answer(f"{arm.mlflow}/{API}/model-versions/search?max_results=200"))["model_versions"]
        flow_runs = (await answer(f"{arm.prefect}/api/flow_runs/paginate", {"limit": 200}))["results"]
    runs, models = sorted({one["run_id"] for one in versions}), sorted({one["name"] for one in versions})
    return Known(own["experiment"]["experiment_id"], runs, file, models, [run["id"] for run in flow_runs])


async def drive(arm: Arm, known: Known, users: int, think: float, seconds: float, seed: int) -> list[Sample]:
    """Let users look things up for a while; what each look-up took.

    Args:
        arm: the servers.
        known: what is on them.
        users: how many at once.
        think: mean of the exponential time that each reads between two look-ups [s].
        seconds: length.
        seed: of what they look up and how long they read.
    """
    samples: list[Sample] = []
    end = time.monotonic() + seconds
    limits = aiohttp.ClientTimeout(total=LIMIT)
    connector = aiohttp.TCPConnector(limit=users, keepalive_timeout=IDLE)
    async with aiohttp.ClientSession(headers=arm.headers, timeout=limits, connector=connector) as session:
        people = [one(arm, session, known, think, end, random.Random(f"{seed} {n}"), samples) for n in range(users)]
        await asyncio.gather(*people)
    return samples


async def one(
    arm: Arm,
    session: aiohttp.ClientSession,
    known: Known,
    think: float,
    end: float,
    draw: random.Random,
    samples: list[Sample],
) -> None:
    """One user."""
    await asyncio.sleep(draw.uniform(0, think))  # they do not come all at once
    while time.monotonic() < end:
        what, requests = draw.choice(list(look_ups(known, draw).items()))
        began, error = time.monotonic(), ""
        for request in requests:
            error = error or await ask(arm, session, request)
        samples.append(Sample(arm.name, what, time.monotonic() - began, error))
        reads = draw.expovariate(1 / think) if think else 0.0
        await asyncio.sleep(max(0.0, min(reads, end - time.monotonic())))


async def ask(arm: Arm, session: aiohttp.ClientSession, request: Request) -> str:
    """Ask and read the whole answer; what went wrong, or ""."""
    address = f"{arm.mlflow if request.server == 'mlflow' else arm.prefect}/{request.path}"
    way = "GET" if request.body is None else "POST"
    try:
        async with session.request(way, address, json=request.body) as reply:
            await reply.read()
            return "" if reply.status == 200 else f"status {reply.status}"
    except (aiohttp.ClientError, TimeoutError) as error:
        return type(error).__name__
