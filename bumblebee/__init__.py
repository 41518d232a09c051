"""BumbleBee: from motion capture to a humanoid's registered policy, and from its logs back to the simulator.

The functions of `bumblebee.api` are offered here and imported when they are used (docs/api.md).
"""

from importlib import import_module
from typing import Any

__version__ = "0.2.0"
DISTRIBUTION = "bumblebee-humanoid"
"""Name of the installed distribution; `bumblebee` is another project's on the package index."""

_OFFERED = {
    "api.motions": ("read_motions", "make_motion", "retarget", "film"),
    "api.training": ("train",),
    "api.policies": ("load_policy", "evaluate", "follow"),
    "api.diagnosis": ("open_dataset", "gap", "diagnose", "replay", "plan"),
    "robot.facts": ("joint_names",),
    "errors": ("BadInput",),
}
__all__ = [name for names in _OFFERED.values() for name in names]


def __getattr__(name: str) -> Any:
    """Import a name of the API when it is used first."""
    for module, names in _OFFERED.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Names of the API beside the module's own."""
    return sorted({*globals(), *__all__})
