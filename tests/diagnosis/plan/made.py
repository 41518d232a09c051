"""Plans of the tiny arm and of the stander, each made once."""

from dataclasses import replace
from functools import cache
from typing import Any

import mujoco

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.plan import Plan, PlanConfig, findings_of, make_plan
from bumblebee.sim.effects import single
from tests.diagnosis.arm import XML, session_of, simulate

LIMITS = PlanConfig(runs=2, seconds=5.0, pool=10, speed={"": 4.0}, travel={"": 1.0})


@cache
def slow_session() -> Session:
    """Two rollouts of the arm with viscous friction on j2."""
    return session_of(simulate({("viscous_friction", "j2"): 0.4}, count=2, seconds=3.0, seed=1))


def entry(effect: str, where: str, value: float, half: float, equivalent: list[tuple[str, str]], name: str) -> dict:
    """An entry of `diagnosis.json`."""
    parameters = {name: {"value": value, "ci95": [value - half, value + half], "nominal": 0.0, "unit": ""}}
    same = [{"effect": e, "where": [w]} for e, w in equivalent]
    return {"effect": effect, "where": [where], "parameters": parameters, "equivalent": same}


def friction(half: float = 0.1) -> tuple[dict, list]:
    """A diagnosis that cannot tell viscous friction on j2 from its servo's kd."""
    told = entry("viscous_friction", "j2", 0.4, half, [("kd", "j2")], "damping")
    return {"schema": 1, "effects": [told]}, [single("viscous_friction", "j2", 0.4)]


@cache
def planned(damping: bool = False, seed: int = 0) -> Plan:
    """A plan after `friction`, with another kd to set or without."""
    more = {"damping": (0.2,), "runs": 3, "pool": 16} if damping else {}
    return planned_with(seed=seed, **more)


def planned_with(**settings: Any) -> Plan:
    """A plan after `friction`, with other settings."""
    config = replace(LIMITS, **settings)
    return make_plan(mujoco.MjSpec.from_string(XML), "arm.xml", config, slow_session(), findings_of(*friction()))
