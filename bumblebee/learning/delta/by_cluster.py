"""Delta actions by cluster in one environment: each world's action is corrected as its motion's cluster has it."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

from bumblebee.sim.engine import RobotState
from bumblebee.tracking.env import ActionAdapter, TrackingEnv
from bumblebee.tracking.rows import Rows


def of_clusters(
    env: TrackingEnv, cluster: Sequence[int], adapters: Mapping[int, ActionAdapter]
) -> ActionAdapter | None:
    """Each world's motion is run with its cluster's delta action; None where no cluster has one.

    Args:
        env: the worlds.
        cluster: (N,) cluster index of each clip of `env.library`.
        adapters: cluster index -> its delta action, of the clusters that have one.
    """
    if not adapters:
        return None
    of_clip = torch.as_tensor(cluster, device=env.device)

    def adapt(state: RobotState, middle: Tensor, action: Tensor) -> Tensor:
        now, changed = of_clip[env.clip], action.clone()
        for index, adapter in adapters.items():
            own = Rows(now == index, env.engine.by_mask)
            if len(own):
                part = state if own.ids is None else state[own.ids]
                own.put(changed, adapter(part, own.of(middle), own.of(action)))
        return changed

    return adapt
