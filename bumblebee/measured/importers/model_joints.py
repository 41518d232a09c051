"""A map beside the declared model: joints that it has, and units that suit their kind."""

import difflib
from pathlib import Path

import mujoco

from bumblebee.errors import BadInput
from bumblebee.measured.checks import driven_joints
from bumblebee.measured.importers.column_map import LEFT_OUT, UNCOMMANDED, ColumnMap
from bumblebee.measured.importers.drive import LOCKED

_TURNED = ("rad", "deg", "turn")
_LISTED = "Say a unit a joint, a list, with m for slides; for mm say m, and factors of 0.001 under scale."


def require_joints(path: Path, chosen: ColumnMap, model: mujoco.MjModel | None) -> None:
    """Refuse what the declared model contradicts; without a model nobody can tell.

    Raises:
        BadInput: a joint that the model lacks, a unit of angles for a slide or of lengths for a hinge, or no command
            for a joint that an actuator drives and that is not locked.
    """
    _require_commands(path, chosen, model)
    if model is None:
        if chosen.locked:
            raise BadInput(f"{path}: locked", "the declared model, whose joints these are", "none", "Give it: --model.")
        return
    _require_names(path, chosen, model)
    _require_driven(path, chosen, model)
    _require_units(path, chosen, model)


def _require_names(path: Path, chosen: ColumnMap, model: mujoco.MjModel) -> None:
    known = [name for i in range(model.njnt) if (name := model.joint(i).name)]
    for key, joint in [*(("joints", joint) for joint in chosen.joints), *(("locked", one) for one in chosen.locked)]:
        if joint != LEFT_OUT and joint not in known:
            near = difflib.get_close_matches(joint, known, 1)
            do = f"The nearest is {near[0]}." if near else f"It has {', '.join(known) or 'none with a name'}."[:300]
            raise BadInput(f"{path}: {key}", "joints of the model", repr(joint)[:80], do)


def _require_driven(path: Path, chosen: ColumnMap, model: mujoco.MjModel) -> None:
    """Every joint that an actuator drives is in the log or locked, and none is both."""
    if both := set(chosen.locked) & set(chosen.joints):
        raise BadInput(f"{path}: locked", "joints that are not under joints", ", ".join(sorted(both)))
    known = {*chosen.joints, *chosen.locked}
    if absent := [joint for joint in driven_joints(model) if joint not in known]:
        expected = "every joint that an actuator of the model drives"
        raise BadInput(f"{path}: joints", expected, f"all but {', '.join(absent)}"[:300], LOCKED)


def _require_commands(path: Path, chosen: ColumnMap, model: mujoco.MjModel | None) -> None:
    """A joint whose command is not in the file is none that an actuator drives, which only the model says."""
    driven = None if model is None else driven_joints(model)
    for column in UNCOMMANDED:
        for joint in (chosen.joints[place] for place in chosen.uncommanded(column)):
            where, came = f"{path}: columns: {column}", repr(LEFT_OUT)
            if joint == LEFT_OUT:
                continue
            if joint in _motors(chosen):
                do = f"Name it; {came} is for joints without an actuator."
                raise BadInput(where, f"the column of the motor in the place of {joint}, under transmission", came, do)
            if driven is None:
                expected = f"the declared model beside {came}, which says that {joint} has no actuator"
                raise BadInput(where, expected, "none", "Give the model: --model.")
            if joint in driven:
                do = f"Name it; {came} is for joints without an actuator."
                raise BadInput(where, f"the column of {joint}, which an actuator of the model drives", came, do)


def _motors(chosen: ColumnMap) -> set[str]:
    """Joints in whose place a motor stands that turns several."""
    return {motor for row in chosen.transmission.values() for motor in row}


def _require_units(path: Path, chosen: ColumnMap, model: mujoco.MjModel) -> None:
    """A map that states no unit has the contract's, rad and m."""
    units = chosen.angle_unit * (len(chosen.joints) if len(chosen.angle_unit) == 1 else 1)
    turned = _motors(chosen)  # their units are not the joints'
    for joint, unit in zip(chosen.joints, units, strict=False):
        if joint == LEFT_OUT or joint in turned:
            continue
        slide = int(model.joint(joint).type[0]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
        if slide and unit in _TURNED:
            raise BadInput(f"{path}: angle_unit", f"m for {joint}, which is a slide", unit, _LISTED)
        if unit == "m" and not slide:
            raise BadInput(f"{path}: angle_unit", f"rad, deg or turn for {joint}, which is no slide", unit, _LISTED)
