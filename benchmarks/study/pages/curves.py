"""Learning curves of the study as a picture: success and key body error of training episodes over control steps."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from benchmarks.study.jobs import Job
from bumblebee.learning.learner import CURVE

COLUMNS = {"success": "success of training episodes", "key_error": "key body error [m]"}
_SMOOTH = 15  # iterations
_EVERY = 5  # of them drawn


def draw(out: Path, jobs: Sequence[Job], path: Path) -> None:
    """Each job's curve, behind its parent's; jobs of one kind (their names without the seed) have one colour.

    Jobs that have not begun are left out.
    """
    jobs = [job for job in jobs if (out / job.name / CURVE).exists()]
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "study"
    from matplotlib import pyplot

    kinds = list(dict.fromkeys(kind_of(job.name) for job in jobs))
    colours = dict(zip(kinds, pyplot.get_cmap("tab20").colors, strict=False))
    figure, axes = pyplot.subplots(1, len(COLUMNS), figsize=(10.3, 3.4))
    for axis, (column, label) in zip(axes, COLUMNS.items(), strict=True):
        for job in jobs:
            curve = pd.read_csv(out / job.name / CURVE)
            first = next((parent.steps for parent in jobs if parent.name == job.parent), 0.0)
            smooth = curve[column].rolling(_SMOOTH, min_periods=1).mean()
            seen = (first + curve["frames"]) / 1e6
            axis.plot(seen[::_EVERY], smooth[::_EVERY], color=colours[kind_of(job.name)], linewidth=0.8)
        axis.set(xlabel="million control steps", ylabel=label)
        axis.grid(alpha=0.3)
    handles = [pyplot.Line2D([], [], color=colours[kind], label=kind) for kind in kinds]
    figure.legend(handles=handles, loc="center right", fontsize=8, frameon=False)
    figure.tight_layout(rect=(0, 0, 0.9, 1))
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def kind_of(name: str) -> str:
    """A job's name without its seed: what it has in common with those of the other seeds."""
    return name.split("-", 1)[1]
