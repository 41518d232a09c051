"""Settings of the stage control, which the evaluation reads too, and need not import what trains."""

from dataclasses import dataclass
from typing import Annotated, Literal

from bumblebee.ranges import Ranged, Size


@dataclass(frozen=True)
class ControlConfig(Ranged):
    """Which controls are trained beside the refinement; the settings of their training are those of `refine`."""

    kinds: Annotated[tuple[Literal["declared", "delta"], ...], Size(0)] = ("declared", "delta")
    """`declared`: in the declared model; `delta`: there, with a delta action. None: no controls, and half the time."""

    def __post_init__(self) -> None:
        """Refuse a control that would be trained twice."""
        super().__post_init__()
        self.require(len(set(self.kinds)) == len(self.kinds), "kinds", "distinct kinds")
