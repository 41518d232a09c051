"""Check that a rollout's commands are all that moved the robot: a compensated one had feed-forward torque beside them.

The contract has no column for that torque, and gains were others than the declared ones: a diagnosis that read such a
rollout would find the compensation, turned round, in place of the robot.
"""

from bumblebee.measured.checks.view import View
from bumblebee.measured.metadata import METADATA_KEY

RULE = "compensated"


def check_compensation(view: View) -> bool:
    """Whether a rollout was recorded under a compensation; that is a fatal finding."""
    digest = view.rollout.meta.get("compensation")
    if digest is not None:
        came = f"one recorded under the compensation {str(digest)[:12]}"
        view.add(METADATA_KEY.decode(), None, RULE, "a rollout of the uncompensated robot", came, fatal=True)
    return digest is not None
