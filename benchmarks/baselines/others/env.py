"""The tracking environment with another group's reward, ends of episodes and scale of actions."""

import torch
from torch import Tensor

from benchmarks.baselines.others import exbody2_terms, h2o_terms, hover_terms
from benchmarks.baselines.others.library import MovingLibrary
from benchmarks.baselines.others.scoring import Score
from benchmarks.baselines.others.spec import Baseline
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.observing.terms import add_terms
from bumblebee.tracking.rewards import Step
from bumblebee.tracking.sampling.library import ReferenceFrame
from bumblebee.tracking.sampling.sampler import ClipShares
from bumblebee.tracking.terminations import key_distance

for _terms in (h2o_terms, hover_terms, exbody2_terms):
    add_terms(_terms.SIZES, getattr(_terms, "NOISE", None))


class BaselineEnv(TrackingEnv):
    """Follow the clips of `library` as `baseline` has it.

    Args:
        library: the reference motions, with the speeds of the key bodies, on the engine's device.
        engine: the robots; its worlds are randomised here.
        baseline: the task and the reward.
        seed: of every draw in here.
        clip_share: shares of the draws of groups of clips, if they are to hold whatever fails.
    """

    def __init__(
        self,
        library: MovingLibrary,
        engine: Engine,
        baseline: Baseline,
        seed: int = 0,
        clip_share: ClipShares | None = None,
    ) -> None:
        super().__init__(library, engine, baseline.env, seed, clip_share=clip_share)
        self.baseline = baseline
        self.scale = torch.full_like(self.scale, baseline.scale)
        self.score = Score(baseline.scoring, self.dt, self.episode_length_buf, self._lost)
        self._earned = self.score

    def _fallen(self, step: Step) -> Tensor:
        return self.baseline.lost(step.state, step.ref)

    def _lost(self, state: RobotState, ref: ReferenceFrame) -> Tensor:
        return self.baseline.lost(state, ref) | (key_distance(state, ref) > self._threshold)

    def _kept(self) -> dict[str, Tensor]:
        return super()._kept() | {f"score_{name}": tensor for name, tensor in self.score.kept().items()}
