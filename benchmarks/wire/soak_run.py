"""One run of the soak, with console, guard and policy as `bumblebee deploy run` starts them, on a long clip.

python -m benchmarks.wire.soak_run POLICY WIRE OUT SECONDS
"""

import sys
from pathlib import Path

from benchmarks.wire.common import lasting
from bumblebee.last_line import guarded
from bumblebee.wire.robot_end.stand_in import QUICK
from bumblebee.wire.session import Run, run


def main() -> int:
    """Run the process."""
    policy, wire, out, seconds = sys.argv[1:]
    clip = lasting(float(seconds))
    job = Run(Path(policy), clip, wire, Path(out), ramps=QUICK, unattended=True, operator="soak")
    return guarded(lambda: 0 if run(job, print)[0].reason == "" else 4)


if __name__ == "__main__":
    raise SystemExit(main())
