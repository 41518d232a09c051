"""The base policies that come with BumbleBee, trained on a GPU; README.md beside each is its card."""

from pathlib import Path

from bumblebee.io.there import require_there

FOLDER = Path(__file__).parent
"""A policy's folder, as `load_policy` reads it."""
RANDOMISED = FOLDER / "randomised"
"""Another one: it learnt on robots that differ, with delays, and follows less closely."""
IMU = FOLDER / "imu"
"""A third one: it learnt on such robots too, and sees what an IMU and encoders give, without odometry."""
NAMES = {FOLDER: "pretrained", RANDOMISED: "pretrained-randomised", IMU: "pretrained-imu"}
"""Names of the parents that a policy began from, on its card."""
_REAL = 'G1 Moves (CC BY 4.0, attribution: "G1 Moves, Experiential Technologies"), ASAP (MIT)'
_CMU = "CMU's motion capture database (free to use; mocap.cs.cmu.edu, funded by NSF EIA-0196217)"
MOTIONS = {FOLDER: _REAL, RANDOMISED: f"{_REAL}, {_CMU}", IMU: f"{_REAL}, {_CMU}"}
"""Real motions that each has learnt from, with licences that whatever goes on from its weights keeps."""
SHIPPED = {"shipped": FOLDER, "randomised": RANDOMISED, "imu": IMU}
"""Names by which a user asks for them."""
THEIRS = "g1_23dof"
"""The robot of all three."""
NO_POLICY = f"Train it first, or take one that comes along: {', '.join(SHIPPED)}."


def require_policy(name: str) -> None:
    """`BadInput` where `name` is neither a policy that comes along nor a folder."""
    if name not in SHIPPED:
        require_there(Path(name).expanduser(), "a trained policy", NO_POLICY)


def require_seen(path: Path) -> None:
    """`BadInput` where nothing lies at `path`, and no policy that comes along has the name."""
    if str(path) not in SHIPPED:
        expected = f"a path, or a policy that comes along: {', '.join(SHIPPED)}"
        require_there(path, expected, "docs/viewing.md says what can be seen.")
