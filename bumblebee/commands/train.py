"""Command line: `bumblebee train`."""

from pathlib import Path
from typing import Annotated

import typer

from bumblebee.commands.files import CsvFps, Settings
from bumblebee.errors import plain
from bumblebee.io.there import require_motions

_PIECE = 10.0  # s: the longest episode of a training


def train(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Motion files of any known format.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for the policy, its card and its film.")] = Path("policy"),
    minutes: Annotated[float, typer.Option("--minutes", help="Time of the training itself.")] = 15.0,
    gpu: Annotated[bool, typer.Option("--gpu", help="Simulate on an NVIDIA GPU.")] = False,
    start: Annotated[str, typer.Option("--from", help="shipped, randomised, imu, nothing, or a folder.")] = "shipped",
    learner: Annotated[str | None, typer.Option("--learner", help="ppo (on a CPU), world_model (on a GPU).")] = None,
    held_out: Annotated[float, typer.Option("--held-out", help="Share of the motions to hold out.")] = 0.15,
    worlds: Annotated[int | None, typer.Option("--worlds", help="Robots; 512 on a CPU, 4,096 on a GPU.")] = None,
    threads: Annotated[int, typer.Option("--threads", help="CPU threads of the physics.")] = 2,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the network and of all draws.")] = 0,
    csv_fps: CsvFps = None,
    settings: Settings = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a policy of an earlier training.")] = False,
) -> None:
    """Train a policy on a folder of motions. Stopped, the same command goes on from its last checkpoint."""
    require_motions(folder)
    from dataclasses import asdict

    from bumblebee.api.policy_card import splits, tried
    from bumblebee.api.training import TrainConfig, parent_of, require_ready
    from bumblebee.api.training import train as fit
    from bumblebee.io.write import refuse_overlap
    from bumblebee.learning import pretrained
    from bumblebee.motion.cache import user_cache
    from bumblebee.motion.reading.few_lines import said_of
    from bumblebee.motion.reading.folder import ReadConfig, read_folder
    from bumblebee.motion.reading.one_file import stated
    from bumblebee.policy.card_text import NOTHING
    from bumblebee.report.wording import plural
    from bumblebee.robot.facts import ROBOT
    from bumblebee.sim.quiet import quiet_mujoco

    quiet_mujoco()
    if start == "shipped" and ROBOT != pretrained.THEIRS:
        print(f"no policy comes along for {ROBOT}: training begins from nothing")
        start = NOTHING
    chosen = {"minutes": minutes, "gpu": gpu, "start": start, "learner": learner, "held_out": held_out}
    config = TrainConfig(**chosen, worlds=worlds, threads=threads, seed=seed)  # type: ignore[arg-type]
    refuse_overlap(out, [folder])
    require_ready(config, out, overwrite)
    files = ReadConfig(**vars(stated(settings or [], csv_fps=csv_fps)), max_seconds=_PIECE)
    reading = read_folder(folder, files, cache=user_cache())
    for line in reading.skipped_lines:
        print(line)
    read, skipped = plural(len(reading.clips), "motion"), plural(len(reading.skipped), "file")
    print(f"{read} of at most {_PIECE:g} s read, {skipped} skipped", flush=True)

    def say(text: str) -> None:
        print(plain(text), flush=True)

    made = fit(reading.clips, out, overwrite=overwrite, say=say, **asdict(config))
    for line in said_of("dropped", zip(made.dropped["motion"], made.dropped["explanation"], strict=True)):
        print(line)
    print("\n".join(line for line in tried(made.trials, splits(parent_of(config.start))) if line))
    print(f"written: {out}: policy.onnx, contract.json, README.md (the card), film.gif, policy.pt, trials.csv")
