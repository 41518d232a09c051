"""Where and why a policy loses motions: by motion, with restarts before the loss, and what its jumps would need.

    python -m benchmarks.losses FOLDER --motions motions.npz --out losses.csv

A loss that comes again when the robot starts at the reference half a second before it is a matter of that place; one
that does not is a matter of what had gathered until then. For flights of the reference the robot's own rise stands
beside the reference's.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import pandas as pd
import torch
from torch import Tensor

from benchmarks.flights import flights
from benchmarks.motion_pack import read_pack, whole_motions
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Judge, Manner, roll_out
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.terminations import fallen

BACK = (0.5, 1.0, 2.0)  # s before the loss that the robot starts again
AFTER = 1.0  # s beyond the loss that it must then last


@dataclass(frozen=True)
class Rolled:
    """How N rollouts ended.

    `lost` (N,) frame of the loss, -1 where there was none; `body` the key body farthest then; `drift` (T, N) [m]
    of the root from its reference in the plane; `height` and `wanted` (T, N) [m] of both roots.
    """

    lost: Tensor
    body: list[str]
    drift: Tensor
    height: Tensor
    wanted: Tensor


@torch.inference_mode()
def roll(policy: Policy, clips: Sequence[Clip], starts: Tensor, counts: Tensor, model: mujoco.MjModel) -> Rolled:
    """Roll out each clip from its start (N,) for its count (N,) of frames, without noise, by the rule of the trials."""
    n, library, limit = len(clips), MotionLibrary(clips, policy.shape.ahead), Judge(clips).limit
    engine, lost = make_engine("mujoco", model, n, 1), torch.full((n,), -1)
    body, drift, height, wanted = [""] * n, [], [], []
    for t, tick in enumerate(roll_out(policy, Manner(policy.shape.seen), library, engine, starts=starts)):
        state, ref = tick.state, tick.ref
        distance = torch.nan_to_num((state.key_pos_w - ref.key_pos_w).norm(dim=-1), nan=torch.inf)
        bad = (distance.amax(-1) > limit) | fallen(state, ref) | tick.unstable
        new = bad & (lost < 0) & (t < counts)
        lost[new] = t
        for index in new.nonzero()[:, 0].tolist():
            body[index] = KEY_BODIES[int(distance[index].argmax())]
        drift.append((state.root_pos_w - ref.root_pos_w)[:, :2].norm(dim=-1))
        height.append(state.root_pos_w[:, 2])
        wanted.append(ref.root_pos_w[:, 2])
        if not bool(((lost < 0) & (t + 1 < counts)).any()):
            break
    return Rolled(lost, body, torch.stack(drift), torch.stack(height), torch.stack(wanted))


def losses(policy: Policy, clips: Sequence[Clip], model: mujoco.MjModel) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Follow each clip, again from before its loss if it is lost, and measure its flights above 0.2 m.

    Returns:
        the motions: name, family, split, seconds, lost_at [s], body, drift_before [m] 1 s before, passes_* after
        restarts; and the flights: what they need, how far the reference's root rises, and how far the robot's did.
    """
    frames = torch.tensor([clip.frames for clip in clips])
    whole = roll(policy, clips, torch.zeros_like(frames), frames - 1, model)
    fps = clips[0].fps
    table = pd.DataFrame(
        [(c.name, c.family, c.split, c.duration) for c in clips], columns=["name", "family", "split", "seconds"]
    )
    at = whole.lost
    table["lost_at"] = torch.where(at < 0, torch.nan, at / fps).numpy()
    table["body"] = whole.body
    before = (at - round(fps)).clamp(min=0)
    table["drift_before"] = torch.where(at < 0, torch.nan, whole.drift[before, torch.arange(len(clips))]).numpy()
    ids = (at >= 0).nonzero()[:, 0]
    for back in BACK:
        table[f"passes_{back:g}s"] = None
        if len(ids):
            start = (at[ids] - round(back * fps)).clamp(min=0)
            count = torch.minimum(at[ids] + round(AFTER * fps), frames[ids] - 1) - start
            again = roll(policy, [clips[i] for i in ids.tolist()], start, count, model)
            table.loc[ids.tolist(), f"passes_{back:g}s"] = (again.lost < 0).numpy()
    return table, pd.DataFrame([row for i, clip in enumerate(clips) for row in _jumps(clip, i, whole)])


def _jumps(clip: Clip, index: int, whole: Rolled) -> list[dict]:
    rows = []
    for flight in flights(clip, height=0.2):
        # frame t of a rollout is frame t + 1 of the clip
        span = slice(max(flight.start - 1, 0), min(flight.end + 5, len(whole.height)))
        if span.start >= len(whole.height):
            continue
        floor = whole.wanted[span.start, index]
        at = int(whole.lost[index])
        rows.append(
            {
                "name": clip.name,
                "split": clip.split,
                **vars(flight),
                "lost_here": bool(flight.start - 15 <= at <= flight.end + 40),
                "rise_wanted": float(whole.wanted[span, index].max() - floor),
                "rise": float(whole.height[span, index].max() - floor),
            }
        )
    return rows


def main() -> None:
    """Write both tables; bad input is one line and status 2."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="with policy.pt, of this repository's own task")
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--out", type=Path, required=True, help="CSV file; the flights' stands beside it")
    options = parser.parse_args()
    torch.set_num_threads(1)
    try:
        rows = [row for row in whole_motions(read_pack(options.motions)) if row.group != "embedded"]
        table, jumps = losses(load_policy(options.folder), [row.clip for row in rows], load_model(physics_hz=200.0))
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None
    options.out.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out, index=False)
    jumps.to_csv(options.out.with_name(f"{options.out.stem}-flights.csv"), index=False)
    lost = table[table["lost_at"].notna()]
    print(
        f"lost {len(lost)} of {len(table)}; 1 s before, {lost['drift_before'].median():.2f} m off in the plane (median)"
    )
    for back in BACK:
        print(f"restarted {back:g} s before: {int(lost[f'passes_{back:g}s'].sum())} pass")
    print(jumps.round(2).to_string(index=False))


if __name__ == "__main__":
    main()
