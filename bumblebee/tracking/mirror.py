"""The robot in a mirror: left and right exchanged, the world reflected in the plane of x and z. An option of ours.

A reflected observation asks for the reflected action; a training can learn from both (rsl_rl's symmetry augmentation).
"""

from collections.abc import Callable, Sequence

import torch
from tensordict import TensorDict
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.robot.facts import FEET, KEY_BODIES, PELVIS
from bumblebee.robot.mirror import mirrored_joints, other_side
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.observing.terms import Part, parts

Reflection = tuple[list[int], list[float]]
"""For each entry of a reflected vector the entry that it comes from, and the sign that it gets."""

_SAME: Reflection = ([0], [1.0])
_POLAR: Reflection = ([0, 1, 2], [1.0, -1.0, 1.0])  # a place or velocity
_AXIAL: Reflection = ([0, 1, 2], [-1.0, 1.0, -1.0])  # an angular velocity
_COLUMNS: Reflection = ([0, 1, 2, 3, 4, 5], [1.0, -1.0, -1.0, 1.0, 1.0, -1.0])  # two columns of a rotation matrix


def joint_reflection() -> Reflection:
    """Reflection of values of the joints: sides exchanged, turns about x and z (roll, yaw) with the other sign."""
    index, sign = mirrored_joints()
    return list(index), list(sign)


def body_reflection(names: Sequence[str]) -> Reflection:
    """Reflection of places of bodies, three entries each."""
    order = [list(names).index(other_side(name)) for name in names]
    return [3 * body + k for body in order for k in range(3)], [1.0, -1.0, 1.0] * len(order)


def reflection(parts: Sequence[Part]) -> Reflection:
    """Reflection of an observation with these parts.

    Raises:
        BadInput: for a part whose reflection nobody has written down.
    """
    known = _known()
    index: list[int] = []
    sign: list[float] = []
    for name, size in parts:
        stem = name.split("_", 1)[1] if name.startswith("ahead") else name
        if (stem, size) not in known:
            names = ", ".join(sorted({stem for stem, _ in known}))
            raise BadInput("ppo.symmetry", f"observations of {names}", repr(name), "Train without it.")
        own, signs = known[stem, size]
        index += [len(sign) + k for k in own]
        sign += signs
    return index, sign


def critic_extras(joint_count: int) -> list[Part]:
    """Parts that the critic sees beside the policy's."""
    return [("foot_force", 3 * len(FEET)), ("torque", joint_count), ("time_left", 1), ("threshold", 1)]


def augmentation(env: TrackingEnv) -> Callable[..., tuple[TensorDict | None, Tensor | None]]:
    """rsl_rl's function (env, obs, actions) that appends the reflected samples to either, if given."""
    policy = env.groups["policy"]
    seen = policy.parts * env.cfg.observation.history + policy.parts_now
    beside = parts(env.cfg.critic, env.num_actions, len(env.library.ahead)) + critic_extras(env.num_actions)
    tables = {"policy": reflection(seen), "critic": reflection(seen + beside)}
    on_device = {name: _tensors(table, env.device) for name, table in tables.items()}
    turn = _tensors(joint_reflection(), env.device)

    def both(
        env: TrackingEnv, obs: TensorDict | None, actions: Tensor | None
    ) -> tuple[TensorDict | None, Tensor | None]:
        if obs is not None:
            groups = {name: _with_reflected(obs[name], table) for name, table in on_device.items()}
            obs = TensorDict(groups, batch_size=[2 * obs.batch_size[0]])
        return obs, None if actions is None else _with_reflected(actions, turn)

    return both


def _with_reflected(values: Tensor, table: tuple[Tensor, Tensor]) -> Tensor:
    """Values (B, D) and behind them their reflections, (2 B, D)."""
    index, sign = table
    return torch.cat((values, values[:, index] * sign))


def _tensors(table: Reflection, device: torch.device | str) -> tuple[Tensor, Tensor]:
    return torch.tensor(table[0], device=device), torch.tensor(table[1], device=device)


def _known() -> dict[Part, Reflection]:
    """Reflections of parts by name and size; look-ahead parts go by what follows their number."""
    turn, keys = joint_reflection(), body_reflection(KEY_BODIES)
    but_pelvis = body_reflection([name for name in KEY_BODIES if name != PELVIS])
    polar = ("gravity_b", "root_lin_vel_b", "ref_lin_vel_b", "root_pos_b", "target_lin_vel_b")
    rotations = ("ref_rotation", "rotation", "root_rotation_g", "target_root_rotation_g", "target_root_rotation_b")
    turned = ("joint_pos", "joint_vel", "last_action", "ref_joint_pos", "ref_joint_vel", "torque")
    bodies = ("key_error_b", "target_key_pos_g", "target_key_pos_b")
    sets = (
        ((*polar, "target_root_pos_g", "target_root_pos_b", "ref_lin_vel_o", "root_pos_o"), _POLAR),
        (("root_ang_vel_b", "ref_ang_vel", "target_ang_vel"), _AXIAL),
        (("root_height", "ref_height", "time_left", "threshold"), _SAME),
        (rotations, _COLUMNS),
        ((*turned, "target_joint_pos", "target_joint_vel"), turn),
        ((*bodies, "key_pos_b"), keys),
        (("key_pos_b", "posture_error"), but_pelvis),
        (("foot_force",), body_reflection(FEET)),
    )
    return {(name, len(own[0])): own for names, own in sets for name in names}
