"""The delta action: a small policy that corrects the simulator's ankles where it still errs (paper, section 3.3.2).

It sees the robot's own state and the joint targets of the tracking policy, and adds a correction to the targets of
the four ankle joints before they reach the simulator: s' = f_sim(s, a + delta(s, a)). Position and heading in the
world are hidden from it. The correction is in radians of target, so no action scale can be forgotten on it.
"""

import copy
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.files import save_tensors
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.delta.rewards import DeltaRewardConfig
from bumblebee.ranges import Factor, Few, Name, Positive, Range, Ranged, Seed, Size
from bumblebee.robot.facts import ANKLE_JOINTS, joint_names
from bumblebee.sim.engine import RobotState
from bumblebee.sim.engine_choice import Name as EngineName
from bumblebee.sim.rotations import conjugate, matrix
from bumblebee.sim.warp_limits import Buffers

WEIGHTS, CARD = "delta.pt", "card.json"


@dataclass(frozen=True)
class RegressionConfig(Ranged):
    """The fit of a delta action by regression; see `learning.delta.regression`."""

    windows: Annotated[int, Range(least=100, most=1_000_000)] = 6000
    """Short replays that are fitted at most, drawn from all that the recordings hold."""
    steps: Annotated[int, Range(least=1, most=100)] = 3
    """Control steps of a replay."""
    passes: Annotated[int, Range(least=1, most=100)] = 5
    """Fits, each but the first around the one before."""
    nudges: Annotated[tuple[Positive, ...], Size()] = (0.1, 0.4)
    """Changes of a target, up and down, by which its influence is found [rad]: the one that explains more is taken."""
    ridges: Annotated[tuple[Positive, ...], Size()] = (0.001, 0.01, 0.1, 1.0)
    """Strengths of regularisation that are tried, by the fit's own diagonal."""
    folds: Annotated[int, Range(least=2, most=100)] = 10
    """Parts of the recordings that are left out in turn."""
    evidence: Annotated[float, Range(least=0, most=100)] = 2.0
    """Standard errors by which the misfit must fall on what was left out; else nothing is corrected."""


DELTA_PPO = PpoConfig(
    iterations=60,
    gamma=0.95,
    entropy=0.0,
    desired_kl=0.02,
    desired_kl_end=0.02,
    hidden=(128, 64),
    initial_std=0.05,
)
"""For minutes on a CPU; `profiles/paper.yaml` has the paper's."""


@dataclass(frozen=True)
class DeltaConfig(Ranged):
    """Training of one cluster's delta action."""

    method: Literal["regression", "ppo"] = "regression"
    """How the correction is learnt: by regression on short replays, or by PPO as in the paper, which `ppo`, `rewards`,
    `action_penalty` and `divergence` are about."""
    regression: RegressionConfig = field(default_factory=RegressionConfig)
    """The regression."""
    ppo: PpoConfig = field(default_factory=lambda: DELTA_PPO)
    """The algorithm; its `initial_std` is in radians of correction."""
    engine: EngineName = "mujoco"
    """Engine that replays the recordings: `mujoco_warp` on a GPU."""
    buffers: Buffers = field(default_factory=Buffers)
    """Room for contacts on a GPU."""
    num_envs: Annotated[int, Range(least=1, most=1000000)] = 256
    """Robots that replay recordings at once."""
    threads: Few = 1
    """CPU threads of the simulator."""
    seed: Seed = 0
    """Seed of starts, exploration and network."""
    joints: Annotated[tuple[Name, ...], Size()] = ANKLE_JOINTS
    """Joints that the correction acts on (paper: the four ankle joints)."""
    limit: Annotated[float, Range(above=0, most=3.2)] = 1.2
    """Largest correction of a target [rad]."""
    episode_seconds: Annotated[float, Range(least=0.02, most=3600)] = 1.0
    """Length of an episode, restarted from a recorded state."""
    action_penalty: Factor = 0.05
    """Factor on the table's two action rows: 1 is the paper's, which with corrections this small allows none."""
    divergence: Positive = 0.5
    """An episode ends where the root is this far from the recording [m]."""
    rewards: DeltaRewardConfig = field(default_factory=DeltaRewardConfig)
    """The table's weights."""

    def __post_init__(self) -> None:
        """Refuse joints that the robot has not, and batches smaller than the parts that they are learnt in."""
        super().__post_init__()
        self.require_names("joints", joint_names())
        batch, parts = self.num_envs * self.ppo.steps, self.ppo.mini_batches
        self.require(batch >= parts, "num_envs", f"times ppo.steps, at least ppo.mini_batches, {parts}")
        self.require(not self.ppo.symmetry, "ppo", "symmetry: false, since a correction is not reflected")


def layout(joints: int = len(joint_names())) -> list[tuple[str, int]]:
    """Names and sizes of what the delta action sees."""
    parts = [("gravity_b", 3), ("root_lin_vel_b", 3), ("root_ang_vel_b", 3)]
    return [*parts, ("joint_pos", joints), ("joint_vel", joints), ("joint_target", joints)]


def observe(state: RobotState, targets: Tensor) -> Tensor:
    """Observation (B, D), parts as in `layout`; targets (B, J) [rad] are the tracking policy's."""
    gravity_b = -matrix(conjugate(state.root_quat_w))[:, :, 2]
    parts = (gravity_b, state.root_lin_vel_b, state.root_ang_vel_b, state.joint_pos, state.joint_vel, targets)
    return torch.cat(parts, dim=-1)


def placement(joints: tuple[str, ...]) -> Tensor:
    """(len(joints), J) matrix that puts the corrections of `joints` into their columns of a target vector."""
    names = joint_names()
    matrix_ = torch.zeros(len(joints), len(names))
    for row, name in enumerate(joints):
        if name not in names:
            raise BadInput("params.yaml: delta.joints", "joints of the robot", name)
        matrix_[row, names.index(name)] = 1.0
    return matrix_


class DeltaAction:
    """A trained correction; calling it gives the corrected targets.

    Args:
        network: observation (B, D) -> raw output (B, len(joints)).
        joints: joints that are corrected.
        limit: largest correction [rad].
    """

    def __init__(self, network: torch.nn.Sequential, joints: tuple[str, ...], limit: float) -> None:
        self.network, self.joints, self.limit = network.eval(), tuple(joints), float(limit)
        self._placement = placement(self.joints)

    @property
    def hidden(self) -> tuple[int, ...]:
        """Units of the network's hidden layers; none where it is linear."""
        layers = [layer for layer in self.network.modules() if isinstance(layer, torch.nn.Linear)]
        return tuple(layer.out_features for layer in layers[:-1])

    @property
    def normaliser(self) -> "Normaliser":
        """The network's first layer."""
        first = self.network[0]
        assert isinstance(first, Normaliser)
        return first

    def __call__(self, state: RobotState, targets: Tensor) -> Tensor:
        """Targets (B, J) [rad] with the correction added."""
        with torch.no_grad():
            raw = self.network(observe(state, targets))
        return targets + correction(raw, self.limit) @ self._placement

    def on(self, device: torch.device) -> "DeltaAction":
        """Copy of the delta action on a device."""
        twin = DeltaAction(copy.deepcopy(self.network).to(device), self.joints, self.limit)
        twin._placement = self._placement.to(device)
        return twin


def correction(raw: Tensor, limit: float) -> Tensor:
    """Correction [rad] of a raw output: linear near 0, never beyond `limit`."""
    return limit * torch.tanh(raw / limit)


def save_delta(folder: Path, delta: DeltaAction, card: dict[str, object]) -> None:
    """Write weights (tensors only) and card into an existing folder."""
    save_tensors(Path(folder) / WEIGHTS, delta.network.state_dict())
    shape = {"joints": list(delta.joints), "limit": delta.limit, "hidden": list(delta.hidden)}
    (Path(folder) / CARD).write_text(json.dumps({"schema": 1, "network": shape, **card}, indent=2))


def load_delta(folder: Path, promoted_only: bool = True) -> DeltaAction | None:
    """Read a delta action; None where it was not kept because it did not beat no delta (`promoted_only`)."""
    file = Path(folder) / CARD
    if not file.exists():
        raise BadInput(file, "the card of a delta action", "no such file", "Run the delta stage.")
    card = json.loads(file.read_text())
    if promoted_only and not card["promoted"]:
        return None
    shape = card["network"]
    network = make_network(tuple(shape["hidden"]), len(shape["joints"]))
    network.load_state_dict(torch.load(Path(folder) / WEIGHTS, weights_only=True))
    return DeltaAction(network, tuple(shape["joints"]), shape["limit"])


class Normaliser(torch.nn.Module):
    """Fixed shift and scale of the observation, from the recordings themselves."""

    mean: Tensor
    std: Tensor

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("std", torch.ones(size))

    def fit(self, values: Tensor) -> None:
        """Take mean and deviation of (N, D); columns that hardly vary are only shifted."""
        self.mean.copy_(values.mean(0))
        self.std.copy_(values.std(0).clamp(min=0.05))

    def forward(self, values: Tensor) -> Tensor:
        """Normalised values (N, D)."""
        return (values - self.mean) / self.std


def make_network(hidden: tuple[int, ...], outputs: int) -> torch.nn.Sequential:
    """Normaliser, hidden ELU layers, linear output that starts at zero: an untrained delta corrects nothing."""
    size = sum(n for _, n in layout())
    layers: list[torch.nn.Module] = [Normaliser(size)]
    for units in hidden:
        layers += [torch.nn.Linear(size, units), torch.nn.ELU()]
        size = units
    last = torch.nn.Linear(size, outputs)
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.zeros_(last.bias)
    return torch.nn.Sequential(*layers, last)


def action_adapter(delta: DeltaAction, scale: Tensor) -> Callable[[RobotState, Tensor, Tensor], Tensor]:
    """The correction as `TrackingEnv` takes it: on actions, around the targets of an action of zero.

    Args:
        delta: the trained correction of targets.
        scale: (J,) [rad] of target for a unit of action.
    """
    there: dict[torch.device, tuple[DeltaAction, Tensor]] = {}

    def adapt(state: RobotState, middle: Tensor, action: Tensor) -> Tensor:
        device = action.device
        if device not in there:
            there[device] = (delta.on(device), scale.to(device))
        correct, unit = there[device]
        targets = middle + unit * action
        return action + (correct(state, targets) - targets) / unit

    return adapt


def magnitudes(delta: DeltaAction, state: RobotState, targets: Tensor) -> dict[str, float]:
    """Mean absolute correction of each joint [rad] over B states (paper, table of delta magnitudes)."""
    change = (delta(state, targets) - targets).abs().mean(0).numpy()
    names = joint_names()
    return {name: float(np.round(change[names.index(name)], 6)) for name in delta.joints}
