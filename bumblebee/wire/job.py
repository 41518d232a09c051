"""The guard's part of a run, handed over by the console as one JSON object on the command line."""

import json
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from bumblebee.wire.plan import Plan
from bumblebee.wire.safety.limits import Drives, Limits
from bumblebee.wire.safety.phases import Ramps


@dataclass(frozen=True)
class Job:
    """The guard's part of a run."""

    wire: str
    at: str
    slow: float
    plan: Plan
    drives: Drives


def encode_job(job: Job) -> str:
    """Text of a job."""
    return json.dumps(asdict(job), default=lambda value: value.tolist())


def decode_job(text: str) -> Job:
    """Job from the text of `encode_job`."""
    read = json.loads(text)
    plan = read["plan"]
    inner = {"hold": np.array(plan["hold"]), "numbers": tuple(plan["numbers"])}
    inner |= {"limits": Limits(**plan["limits"]), "ramps": Ramps(**plan["ramps"])}
    return Job(**read | {"plan": Plan(**plan | inner), "drives": _drives(read["drives"])})


def _drives(read: dict[str, Any]) -> Drives:
    rest = {field.name: np.array(read[field.name]) for field in fields(Drives) if field.name != "joints"}
    return Drives(joints=tuple(read["joints"]), **rest)
