"""MuJoCo without its warnings, for commands that try what may diverge."""

import mujoco


def quiet_mujoco() -> None:
    """Keep MuJoCo's warnings off the terminal and out of MUJOCO_LOG.TXT: what diverges in a search is judged so."""
    mujoco.set_mju_user_warning(lambda text: None)
