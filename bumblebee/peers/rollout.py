"""The rollout of a peer's policy on motions, tick by tick as `learning.rollout.roll_out` gives our policies'."""

from collections.abc import Iterator
from dataclasses import replace

import torch
from torch import Tensor

from bumblebee.learning.rollout import Tick
from bumblebee.peers.contract import PeerContract
from bumblebee.peers.observer import Observer
from bumblebee.peers.policy import Peer
from bumblebee.robot.facts import joint_names
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.tracking.sampling.library import MotionLibrary, ReferenceFrame
from bumblebee.tracking.sampling.starts import start_state


class JointOrder:
    """Joint values (B, ...) from one order into others: the motions' (23), the model's and the contract's.

    A joint that the motions or the model lack, such as a wrist, stands still at 0.

    Args:
        contract: the peer's.
        model_joints: number of the model's joints: those that are actuated here, or every one.
    """

    def __init__(self, contract: PeerContract, model_joints: int) -> None:
        motion, model, peer = (
            joint_names(),
            joint_names(every=model_joints == len(joint_names(every=True))),
            contract.joints,
        )
        self._model_of_motion = _columns(model, motion)
        self._peer_of_motion = _columns(peer, motion)
        self._peer_of_model = _columns(peer, model)
        self._motion_of_model = _columns(motion, model)
        self._model_of_peer = _columns(model, peer)

    def start(self, qpos: Tensor, qvel: Tensor) -> tuple[Tensor, Tensor]:
        """The model's qpos (B, 7 + M) and qvel (B, 6 + M) for those of 23 joints."""
        joints, speeds = (_taken(part, self._model_of_motion) for part in (qpos[:, 7:], qvel[:, 6:]))
        return torch.cat((qpos[:, :7], joints), dim=1), torch.cat((qvel[:, :6], speeds), dim=1)

    def targets(self, peer: Tensor) -> Tensor:
        """The model's joint targets (B, M) for the contract's (B, J)."""
        return _taken(peer, self._model_of_peer)

    def seen(self, state: RobotState) -> RobotState:
        """The model's state with joints as the contract orders them."""
        return _with_joints(state, self._peer_of_model)

    def judged(self, state: RobotState) -> RobotState:
        """The model's state with the motions' 23 joints."""
        return _with_joints(state, self._motion_of_model)

    def reference(self, ref: ReferenceFrame) -> ReferenceFrame:
        """A frame of the motions with joints as the contract orders them."""
        joints, speeds = (_taken(part, self._peer_of_motion) for part in (ref.joint_pos, ref.joint_vel))
        return replace(ref, joint_pos=joints, joint_vel=speeds)


def _columns(wanted: tuple[str, ...], there: tuple[str, ...]) -> Tensor:
    """Index of each wanted joint among those that are there; -1 for none."""
    return torch.tensor([there.index(name) if name in there else -1 for name in wanted])


def _taken(values: Tensor, columns: Tensor) -> Tensor:
    return values[:, columns.clamp(min=0)] * (columns >= 0)


def _with_joints(state: RobotState, columns: Tensor) -> RobotState:
    joints, speeds = (_taken(part, columns) for part in (state.joint_pos, state.joint_vel))
    return replace(state, joint_pos=joints, joint_vel=speeds)


def roll_out_peer(peer: Peer, library: MotionLibrary, engine: Engine) -> Iterator[Tick]:
    """Let a peer's policy follow each of the library's N motions from its first frame, without noise.

    Args:
        peer: the policy.
        library: the motions.
        engine: N robots of `peers.world.peer_model`; they are put at the start.
    """
    contract, dt, ids = peer.contract, engine.control_dt, torch.arange(len(library))
    order, observer = JointOrder(contract, engine.model.nu), Observer(contract)
    seconds = (library.length - 1) / library.fps
    first = library.frames(ids, torch.zeros(len(ids)))
    qpos, qvel = order.start(*start_state(first, 0.0, torch.Generator()))
    engine.reset(ids, qpos, qvel, qpos[:, 7:])
    engine.settle()
    default, scale = (torch.tensor(part, dtype=torch.float32) for part in (contract.default_pos, contract.action.scale))
    last = torch.zeros(len(ids), len(contract.joints))
    rounding = 0.01 * dt
    for tick in range(int((float(seconds.max()) + rounding) / dt)):

        def reference(step: int, tick: int = tick) -> ReferenceFrame:
            return order.reference(library.frames(ids, torch.full((len(ids),), (tick + step) * dt)))

        output = peer.act(observer.see(order.seen(engine.state()), reference, last))
        rule = contract.action
        clipped = output if rule.clip is None else output.clamp(-rule.clip, rule.clip)
        last = output if rule.remembered == "raw" else clipped
        middle = default if rule.around == "default" else reference(1).joint_pos
        engine.step(order.targets(middle + scale * clipped))
        time = torch.full((len(ids),), (tick + 1) * dt)
        running = time <= seconds + rounding
        yield Tick(order.judged(engine.state()), library.frames(ids, time), running, engine.unstable())
