"""The baselines by their names."""

from collections.abc import Callable

from benchmarks.baselines.others.exbody2 import exbody2
from benchmarks.baselines.others.hover import hover
from benchmarks.baselines.others.omnih2o import omnih2o
from benchmarks.baselines.others.spec import Baseline
from bumblebee.errors import BadInput

BASELINES: dict[str, Callable[[], Baseline]] = {"omnih2o": omnih2o, "exbody2": exbody2, "hover": hover}
"""Function that makes each baseline, by name."""


def baseline(name: str) -> Baseline:
    """The baseline of that name.

    Raises:
        BadInput: if there is none.
    """
    if name not in BASELINES:
        raise BadInput("baseline", " or ".join(BASELINES), repr(name))
    return BASELINES[name]()
