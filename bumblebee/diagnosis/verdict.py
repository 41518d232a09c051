"""A correction that is worse than the declared model anywhere is said loudly."""

from typing import Any

_MORE = 1.02  # by so much the error has to be larger to be called so


def worse_horizons(error: dict[str, Any]) -> list[str]:
    """A line for every horizon and measure at which the corrected model errs more than the declared one."""
    lines = []
    for horizon, measures in error["before"].items():
        for name, unit, scale in (("joint_pos_rmse", "mrad", 1e3), ("base_pos_rmse", "mm", 1e3)):
            before = measures.get(name, {}).get("value")
            after = error["after"].get(horizon, {}).get(name, {}).get("value")
            if before is not None and after is not None and after > _MORE * before:
                what = "joints" if name.startswith("joint") else "base"
                lines.append(
                    f"WORSE after {horizon} s: the {what} were {scale * before:.3g} {unit} off with the declared model "
                    f"and are {scale * after:.3g} {unit} off with the correction. Do not use it for motions that long."
                )
    return lines
