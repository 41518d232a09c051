"""A peer's published policy and one of ours on the same motions, whole and in pieces: docs/results/beside-twist2.md.

    python -m benchmarks.motion_pack g1_moves asap_g1 --out motions.npz
    python -m benchmarks.peers twist2_1017_20k.onnx --contract twist2 --motions motions.npz --out results/peers

The peer is tried with its own simulation's facts and with our declared model, each with its own gains and with ours.
Of a motion that is held out (`--split test`) the pieces and, where the filter dropped none of them, the whole count.
"""

import argparse
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path

import pandas as pd

from benchmarks.motion_pack import read_pack, whole_motions
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.motion.clip import Clip
from bumblebee.motion.pieces import motion_of
from bumblebee.peers.policy import Peer
from bumblebee.peers.table import differences, table
from bumblebee.peers.trial import Setting, ours, try_ours, try_peer
from bumblebee.sim.quiet import quiet_mujoco

SETTINGS = [Setting(model, gains) for model in ("own", "declared") for gains in ("own", "declared")]


def clips_of(pack: Path, splits: Sequence[str], only: Sequence[str]) -> dict[str, list[Clip]]:
    """Motions of a pack as "pieces" and as "whole", those made here left out.

    Args:
        pack: file of benchmarks.motion_pack.
        splits: "train", "test" or both.
        only: patterns of the names of motions; all without.
    """
    rows = [
        row
        for row in read_pack(pack)
        if row.group != "embedded"
        and row.clip.split in splits
        and (not only or any(fnmatch(motion_of(row.clip.name), pattern) for pattern in only))
    ]
    kinds = {"pieces": [row for row in rows if row.kept], "whole": whole_motions(rows)}
    return {kind: [row.clip for row in some] for kind, some in kinds.items()}


def report(peer: Peer, against: str, clips: Sequence[Clip], threads: int) -> tuple[list[str], pd.DataFrame]:
    """Lines of the table with the differences, and the trials."""
    name = peer.contract.name
    tried = {f"{name}, {setting}": try_peer(peer, clips, setting, threads) for setting in SETTINGS}
    tried[against] = try_ours(ours(against), clips, threads)
    lines = [*table(tried), ""]
    for setting in SETTINGS:
        if setting.gains == "own":
            key = f"{name}, {setting}"
            lines += [f"{key}, less {against}", *(f"- {x}" for x in differences(tried[key], tried[against])), ""]
    return lines, pd.concat([rows.assign(policy=key) for key, rows in tried.items()], ignore_index=True)


def main() -> None:
    """Try both, print and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("onnx", type=Path)
    parser.add_argument("--contract", required=True)
    parser.add_argument("--motions", type=Path, required=True, help="file of benchmarks.motion_pack")
    parser.add_argument("--against", default="shipped")
    parser.add_argument("--split", nargs="+", default=["test"], choices=("train", "test"))
    parser.add_argument("--only", nargs="+", default=[], metavar="PATTERN", help="names of motions; all without")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    quiet_mujoco()
    try:
        peer = Peer.load(options.onnx, options.contract)
        options.out.mkdir(parents=True, exist_ok=True)
        for kind, clips in clips_of(options.motions, options.split, options.only).items():
            lines, trials = report(peer, options.against, clips, options.threads)
            text = "\n".join([f"{kind}: {len(clips)}, {sum(clip.duration for clip in clips):.0f} s", "", *lines])
            print(text, flush=True)
            trials.to_csv(options.out / f"{kind}.csv", index=False)
            (options.out / f"{kind}.md").write_text(text + "\n")
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
