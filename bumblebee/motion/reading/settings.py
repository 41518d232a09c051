"""Settings of reading: the section `motions.read` of params.yaml."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from bumblebee.motion.describe.describer import DescribeConfig
from bumblebee.motion.grounding import GroundingConfig
from bumblebee.motion.reading.one_file import FileConfig
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.ranges import Name, Range

Hertz = Annotated[float, Range(least=1, most=10_000)]


@dataclass(frozen=True)
class ReadConfig(FileConfig):
    """How motion files become clips."""

    csv_fps_by_folder: dict[Name, Hertz] = field(default_factory=dict)
    """Another rate for the CSV files under a folder of that name, such as `{lafan1: 30}` [Hz]."""
    fps: Hertz = 50.0
    """Frame rate of the clips: that of the policy [Hz]."""
    max_seconds: Annotated[float, Range(least=0, most=3600)] = 10.0
    """Longer motions are cut into equal pieces `<name>_p0`, `_p1` ... no longer than this; 0 never cuts [s]."""
    processes: Annotated[int, Range(least=0, most=256)] = 0
    """How many work side by side; 0: as many as there are cores. The result does not depend on it."""
    retarget: RetargetConfig = field(default_factory=RetargetConfig)
    """From people to the robot."""
    grounding: GroundingConfig = field(default_factory=GroundingConfig)
    """Correction of robot motions that float or sink; retargeted ones stand already."""
    describe: DescribeConfig = field(default_factory=DescribeConfig)
    """Where texts come from."""

    def rate_below(self, place: Path) -> float | None:
        """Rate of the CSV files in a folder by its name, the nearest first, where the settings say one [Hz]."""
        named = (self.csv_fps_by_folder.get(folder.name) for folder in place.parents)
        return next((rate for rate in named if rate is not None), None)

    def __post_init__(self) -> None:
        """Refuse pieces that are shorter than any motion."""
        super().__post_init__()
        self.require(self.max_seconds == 0 or self.max_seconds >= 0.2, "max_seconds", "0, or at least 0.2")
