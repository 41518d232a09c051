"""The base policies that come with BumbleBee, trained on a GPU; README.md beside each is its card."""

from pathlib import Path

FOLDER = Path(__file__).parent
"""A policy's folder, as `load_policy` reads it."""
RANDOMISED = FOLDER / "randomised"
"""Another one: it learnt on robots that differ, with delays, and follows less closely."""
IMU = FOLDER / "imu"
"""A third one: it learnt on such robots too, and sees what an IMU and encoders give, without odometry."""
NAMES = {FOLDER: "pretrained", RANDOMISED: "pretrained-randomised", IMU: "pretrained-imu"}
"""Names of the parents that a policy began from, on its card."""
SHIPPED = {"shipped": FOLDER, "randomised": RANDOMISED, "imu": IMU}
"""Names by which a user asks for them."""
