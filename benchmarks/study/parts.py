"""The parts of the study that are trainings and trials: the jobs of each, and its tables."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.study.jobs import Job, experts_jobs, generalist_jobs, paper_jobs, robust_jobs, table_1_jobs
from benchmarks.study.motions import Motions
from benchmarks.study.pages.generalist_tables import generalist_tables
from benchmarks.study.pages.paper_tables import paper_tables
from benchmarks.study.pages.robust_tables import robust_tables
from benchmarks.study.pages.table_1 import table_1_tables
from benchmarks.study.pages.tables import experts_tables
from benchmarks.study.settings import Study


@dataclass(frozen=True)
class Part:
    """One command of the study."""

    what: str
    jobs: Callable[[Study, Motions], list[Job]]
    tables: Callable[[Path, Study, Motions], str]


PARTS = {
    "experts": Part("experts by cluster, at random, and one policy at equal steps", experts_jobs, experts_tables),
    "generalist": Part("what is distilled of the experts, against them", generalist_jobs, generalist_tables),
    "table-1": Part("the paper's method, its controls and other groups' methods", table_1_jobs, table_1_tables),
    "paper-task": Part("the task as the paper prints it, and what makes it learn", paper_jobs, paper_tables),
    "robust": Part("what keeps a policy up on robots that nobody declared", robust_jobs, robust_tables),
}
