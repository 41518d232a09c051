"""Command line: `bumblebee evaluate`."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bumblebee.commands.files import CsvFps, Settings
from bumblebee.errors import BadInput
from bumblebee.io.there import require_motions, require_there
from bumblebee.learning.pretrained import require_policy
from bumblebee.peers import CONTRACTS

if TYPE_CHECKING:
    import pandas as pd

    from bumblebee.motion.clip import Clip

ContractFile = Annotated[
    str | None, typer.Option("--contract", metavar="FILE", help="Describe an ONNX file of others: YAML, or twist2.")
]
Model = Annotated[str | None, typer.Option("--model", help="Whose simulation, with --contract: own, declared.")]
Gains = Annotated[str | None, typer.Option("--gains", help="Whose servo gains, with --contract: own, declared.")]
Against = Annotated[
    str | None, typer.Option("--against", metavar="POLICY", help="With --contract: try one of ours beside it.")
]


def evaluate(
    policy: Annotated[str, typer.Argument(metavar="POLICY", help="A policy's folder, shipped, randomised, imu; ONNX.")],
    motions: Annotated[str, typer.Argument(metavar="MOTIONS", help="Motion files, or `embedded`.")] = "embedded",
    out: Annotated[Path | None, typer.Option("--out", help="CSV file with a row a rollout.")] = None,
    states: Annotated[
        Path | None, typer.Option("--states", metavar="FOLDER", help="New folder that `bumblebee view` shows.")
    ] = None,
    repeats: Annotated[int, typer.Option("--repeats", help="Rollouts of each motion.")] = 1,
    noise: Annotated[float, typer.Option("--noise", help="Factor on the noise of start and sensors.")] = 0.0,
    limit: Annotated[int | None, typer.Option("--limit", min=1, help="Motions at most.")] = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the noise.")] = 0,
    pieces: Annotated[float, typer.Option("--pieces", min=0, help="Longest piece to cut motions into in s.")] = 0.0,
    contract: ContractFile = None,
    model: Model = None,
    gains: Gains = None,
    against: Against = None,
    csv_fps: CsvFps = None,
    settings: Settings = None,
) -> None:
    """Let a policy follow motions in MuJoCo, and print how many it follows and how closely."""
    _require_inputs(policy, motions, contract, against)
    given = {"--model": model, "--gains": gains, "--against": against}
    if contract is None:
        _require_unused(given, "is for an ONNX file of others. Add --contract FILE.")
    else:
        own = {"--states": states, "--repeats": repeats != 1, "--noise": noise, "--seed": seed}
        _require_unused(own, "is for our own policies. Leave it out.")
    from bumblebee.io.write import refuse_existing, try_output, write_file
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    if out is not None:
        refuse_existing(out)
        try_output(out)
    if contract is None:
        table = _ours(policy, motions, (limit, pieces), (repeats, noise, seed), states, csv_fps, settings)
    else:
        table = _peer(policy, contract, (model, gains), against, motions, (limit, pieces), csv_fps, settings)
    if out is not None:
        write_file(out, table.to_csv(index=False))
        print(f"written: {out}")
    if states is not None:
        print(f"written: {states}; `bumblebee view {states}` shows it")


def _require_inputs(policy: str, motions: str, contract: str | None, against: str | None) -> None:
    """`BadInput` where an input is not there, before anything is imported that takes seconds."""
    if contract is None:
        if policy.endswith(".onnx"):
            raise BadInput(
                policy, "--contract FILE, which describes it", "none", "docs/peers.md says how to write one."
            )
        require_policy(policy)
    else:
        require_there(Path(policy).expanduser(), "an ONNX file")
        if contract not in CONTRACTS:
            require_there(
                Path(contract).expanduser(), f"a contract file, or one that comes along: {', '.join(CONTRACTS)}"
            )
        if against is not None:
            require_policy(against)
    if motions != "embedded":
        require_motions(Path(motions))


def _require_unused(given: Mapping[str, object], why: str) -> None:
    """`BadInput` for the first option that is said and has no meaning here."""
    for option, value in given.items():
        if value:
            raise BadInput(option, "no such option here", str(value), f"It {why}")


def _read(
    motions: str, cut: tuple[int | None, float], csv_fps: float | None, settings: list[str] | None
) -> list["Clip"]:
    """The motions, `cut` to so many and into pieces of at most so many seconds."""
    from bumblebee.api.motions import EMBEDDED, read_motions
    from bumblebee.motion.pieces import split_long
    from bumblebee.motion.reading.one_file import stated

    limit, seconds = cut
    files = stated(settings or [], csv_fps=csv_fps)
    embedded = {} if limit is None else {"limit": limit}
    clips = read_motions(motions, say=print, **(embedded if motions == EMBEDDED else vars(files)))
    if not clips:
        raise BadInput(motions, "a motion", "none")
    return [piece for clip in clips[:limit] for piece in split_long(clip, seconds)]


def _ours(
    policy: str,
    motions: str,
    cut: tuple[int | None, float],
    how: tuple[int, float, int],
    states: Path | None,
    csv_fps: float | None,
    settings: list[str] | None,
) -> "pd.DataFrame":
    from bumblebee.api.policies import evaluate, load_policy
    from bumblebee.api.policy_card import tried

    loaded = load_policy(policy)
    clips, (repeats, noise, seed) = _read(motions, cut, csv_fps, settings), how
    table = evaluate(loaded, clips, repeats=repeats, noise=noise, seed=seed, out=states)
    print("\n".join(line for line in tried(table, {"train": "motions"}, noise) if line))
    return table


def _peer(
    policy: str,
    contract: str,
    chosen: tuple[str | None, str | None],
    against: str | None,
    motions: str,
    cut: tuple[int | None, float],
    csv_fps: float | None,
    settings: list[str] | None,
) -> "pd.DataFrame":
    import pandas as pd

    from bumblebee.evaluation.contract import StartNoise, freeze
    from bumblebee.peers.policy import Peer
    from bumblebee.peers.table import differences, table
    from bumblebee.peers.trial import ours, setting_of, try_ours, try_peer

    setting = setting_of(*chosen)
    peer, other = Peer.load(policy, contract), None if against is None else ours(against)
    clips = _read(motions, cut, csv_fps, settings)
    frozen = freeze(clips, (0,), StartNoise(0.0, 0.0)).sha256[:12]
    print(
        f"{len(clips)} motions or pieces, first frame to last, without noise; evaluation contract {frozen}", flush=True
    )
    name = f"{peer.contract.name} ({setting})"
    tried = {name: try_peer(peer, clips, setting)}
    if other is not None:
        tried[str(against)] = try_ours(other, clips)
    print("\n".join(table(tried)))
    if other is not None:
        print(f"{name} less {against}, over motions:")
        print("\n".join(f"- {line}" for line in differences(tried[name], tried[str(against)])))
    return pd.concat([rows.assign(policy=name) for name, rows in tried.items()], ignore_index=True)
