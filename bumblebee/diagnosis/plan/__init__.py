"""The next experiment: runs within all limits that tell apart what a diagnosis could not."""

from bumblebee.diagnosis.plan.config import Gain, PlanConfig
from bumblebee.diagnosis.plan.findings import findings_of, read_findings
from bumblebee.diagnosis.plan.motions import Motion
from bumblebee.diagnosis.plan.plan import Plan, make_plan
from bumblebee.diagnosis.plan.pool import safe_pool, set_stage
from bumblebee.diagnosis.plan.written.files import claim_plan, write_plan
from bumblebee.diagnosis.plan.written.terminal import summary

__all__ = [
    "Gain",
    "Motion",
    "Plan",
    "PlanConfig",
    "claim_plan",
    "findings_of",
    "make_plan",
    "read_findings",
    "safe_pool",
    "set_stage",
    "summary",
    "write_plan",
]
