"""The least memory of a GPU that the learner through a model needs."""

from collections.abc import Mapping

from bumblebee.learning.gpu_memory import BOOL, FLOAT, LONG, Needs, weights
from bumblebee.learning.world_model.config import WorldModelConfig


def world_model_needs(
    config: WorldModelConfig, robots: int, groups: Mapping[str, int], joints: int, past: int, context: int
) -> Needs:
    """The memory's ring, three networks with their optimisers, and what imagined rollouts and windows leave.

    Of a compiled step it is not known what it keeps; counted is one number for each unit, which it cannot do without.

    Args:
        config: the algorithm.
        robots: how many there are on this GPU.
        groups: sizes of the observations, of "policy" among them.
        joints: J.
        past: P, earlier servo targets in the memory.
        context: C.
    """
    each = FLOAT * (13 + (5 + past) * joints) + 2 * LONG + BOOL
    seen, hidden, inner = groups["policy"], sum(config.hidden), sum(config.model_hidden)
    model = weights((10 + (3 + past) * joints + context, *config.model_hidden, 12 + 2 * joints)) + 2 * inner
    learned = weights((seen, *config.hidden, joints)) + weights((seen, *config.hidden, 1))
    imagined = config.horizon * config.policy_batch * (seen + hidden + inner)
    return Needs(
        {
            "env.num_worlds": config.memory * robots * each,
            "world_model.model_hidden": 3 * FLOAT * model,  # with gradient and momentum
            "world_model.hidden": 4 * FLOAT * learned,  # with average too
        },
        {
            "world_model.policy_batch": FLOAT * imagined,
            "world_model.model_batch": FLOAT * config.window * config.model_batch * inner,
        },
    )
