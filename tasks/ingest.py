"""Check a round's measured rollouts, set bad files aside, and ask for an answer at the gate."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash, read_json
from bumblebee.measured.checks import Thresholds
from bumblebee.measured.intake import IntakeSummary, incoming_files, intake, merge
from bumblebee.measured.model_file import copy_model, load_model
from bumblebee.measured.rollout import copy_of_cluster, read_rollout
from bumblebee.measured.summary import summary_table
from bumblebee.progress import progress
from bumblebee.ranges import Line, Name, Range, Ranged
from bumblebee.robot.model import write_xml
from tasks.approvals import gate, words
from tasks.pages.overview import write_overview
from tasks.running import paths
from tasks.running.stage import load, log_run, output_folder, run_stage


@dataclass(frozen=True)
class IngestConfig(Ranged):
    """Where measured rollouts come from."""

    incoming: Name = paths.ROLLOUTS_OF_ROUND
    """Folder of a round: datasets in folders of their own, one a cluster, or one dataset. `{round}` is its number."""
    model: Line = ""
    """The declared MJCF; empty: the model.xml beside the rollouts, or else this project's G1."""
    gains_tolerance: Annotated[float, Range(least=0, most=1000)] = Thresholds.gains_relative
    """Largest relative difference between a file's kp or kd and the deployed policy's contract; a file beyond it is set
    aside. Gains that are not the declared model's are a condition of the file: it is simulated by its own."""

    def __post_init__(self) -> None:
        """Refuse a folder's name that is none for every round."""
        super().__post_init__()
        try:
            self.incoming.format(round=1)
        except (KeyError, IndexError, ValueError, AttributeError):
            self.require(False, "incoming", "a path with no braces but those of {round}")


def main(round: int) -> None:
    """Sort the rollouts of one round."""
    config = load("ingest", IngestConfig)
    incoming = Path(incoming_of(config.incoming, round))
    folders = dataset_folders(incoming)
    with output_folder(paths.measured(round)) as out:
        write_model(folders, config.model, out / "model.xml")
        limits = Thresholds(gains_relative=config.gains_tolerance)
        batch = sort_rollouts(folders, out, policy_contracts(folders, round), limits, incoming)
        table = write_results(batch, round, out)
        if not batch.accepted:
            kept = keep_rejected(out, round)
            raise BadInput(folders[0].parent, "at least one rollout that can be used", _came(batch), f"See {kept}.")
    shutil.rmtree(paths.rejected(round), ignore_errors=True)
    ask(round)
    counts = {key: float(table[key]) for key in ("accepted", "quarantined", "seconds")}
    log_run("ingest", round=round, params=config, metrics=counts)


def incoming_of(pattern: str, round: int) -> str:
    """The folder of a round; the pattern's only field is its number."""
    try:
        return pattern.format(round=round)
    except (ValueError, LookupError, AttributeError, TypeError):
        where = "params.yaml: ingest.incoming"
        raise BadInput(where, "a folder with no braces but {round}", repr(pattern)[:80]) from None


def dataset_folders(incoming: Path) -> list[Path]:
    """The dataset folders of a round: the folder itself, or each folder in it that holds rollouts."""
    if not incoming.is_dir():
        raise BadInput(incoming, "a folder of measured rollouts", "no such folder")
    inside = [folder for folder in sorted(incoming.iterdir()) if folder.is_dir() and folder.name != "rollouts"]
    folders = [folder for folder in (incoming, *inside) if not folder.name.startswith(".") and incoming_files(folder)]
    if not folders:
        raise BadInput(incoming, "rollouts/*.parquet, or folders that hold them", "none")
    return folders


def write_model(folders: list[Path], given: str, out: Path) -> None:
    """The declared model: the one that was named, the one beside the rollouts, or the G1."""
    beside = [folder / "model.xml" for folder in folders if (folder / "model.xml").is_file()]
    if not given and len({file_hash(path) for path in beside}) > 1:
        raise BadInput(beside[1], f"the same model as {beside[0]}", "another one", "Name one in ingest.model.")
    source = Path(given) if given else beside[0] if beside else None
    if source is None:
        write_xml(out)
        return
    load_model(source)
    copy_model(source, out)


def policy_contracts(folders: list[Path], round: int) -> dict[str, dict[str, Any]]:
    """Cluster -> contract of the policy that was deployed: beside the rollouts, or the expert of the round before."""
    contracts = {}
    for folder in folders:
        for path in (folder / "contract.json", paths.expert(round - 1, folder.name) / "contract.json"):
            if folder.name not in contracts and path.is_file():
                contracts[folder.name] = read_contract(path)
    return contracts


def read_contract(path: Path) -> dict[str, Any]:
    """Contract of a policy as the checks need it: joints, and gains for each."""
    table = read_json(path)
    if not isinstance(table, dict):
        raise BadInput(path, "a JSON object", type(table).__name__)
    joints = table.get("joints", [])
    if not isinstance(joints, list) or not all(isinstance(joint, str) for joint in joints):
        raise BadInput(f"{path}: joints", "a list of names", repr(joints)[:80])
    for key in ("kp", "kd"):
        gains = table.get(key, [])
        numbers = isinstance(gains, list) and all(type(gain) in (int, float) and abs(gain) < 1e9 for gain in gains)
        if not numbers or len(gains) not in (0, len(joints)):
            raise BadInput(f"{path}: {key}", f"{len(joints)} numbers, one a joint", repr(gains)[:80])
    return {"joints": joints} | {key: table[key] for key in ("kp", "kd") if table.get(key)}


def sort_rollouts(
    folders: list[Path],
    out: Path,
    contracts: dict[str, dict[str, Any]],
    limits: Thresholds | None = None,
    incoming: Path | None = None,
) -> IntakeSummary:
    """Every folder through the intake, with progress; a folder in `incoming` is a cluster's and gives it to its files.

    All clusters' rollouts then lie in one folder, and only their metadata tell whose they are.
    """
    model = load_model(out / "model.xml")
    total = sum(len(incoming_files(folder)) for folder in folders)
    good, bad = out / "rollouts", out / "quarantine"
    with progress(total, "checking rollouts", "files") as bar:

        def taken(folder: Path) -> IntakeSummary:
            batch = intake(folder, good, bad, model, contracts, lambda file: bar.update(1, file), limits)
            return batch if incoming in (None, folder) else name_cluster(batch, good, folder.name)

        return merge(map(taken, folders))


def name_cluster(batch: IntakeSummary, accepted: Path, cluster: str) -> IntakeSummary:
    """The batch of a cluster's folder; accepted copies that name no cluster now name it."""
    for item in batch.items:
        file = accepted / item.file
        if item.accepted and not item.cluster:
            file.rename(unnamed := accepted.parent / item.file)
            copy_of_cluster(unnamed, file, cluster)
            unnamed.unlink()
    return replace(batch, items=tuple(replace(item, cluster=item.cluster or cluster) for item in batch.items))


def write_results(batch: IntakeSummary, round: int, out: Path) -> dict[str, Any]:
    """findings.csv, summary.json and overview.html."""
    batch.findings.to_csv(out / "findings.csv", index=False)
    hashes = {"findings_sha256": file_hash(out / "findings.csv"), "model_sha256": file_hash(out / "model.xml")}
    table = summary_table(batch, round) | hashes
    (out / "summary.json").write_text(json.dumps(table, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    write_overview(out / "overview.html", table, batch.findings, _accepted(batch, out))
    return table


def keep_rejected(out: Path, round: int) -> Path:
    """Findings, plots and quarantine of a round of which nothing can be used, beside the pipeline: data/rejected/rN."""
    target = paths.rejected(round)
    with output_folder(target) as folder:
        for name in ("findings.csv", "overview.html", "quarantine"):
            if (out / name).exists():
                (out / name).rename(folder / name)
    return target


def ask(round: int) -> None:
    """Leave the request at the gate; in the automatic mode answer it at once."""
    place = gate.Gate(Path.cwd(), round)
    own = load("gate", gate.GateConfig)
    table = gate.settle(place, own.mode == "auto", own.people)
    if table["status"] in gate.WAITS:
        print(words.how_to_answer(place.workspace, table), flush=True)
    else:
        print(f"round {round}: {words.said(table)}", flush=True)


def _accepted(batch: IntakeSummary, out: Path) -> Iterator[Any]:
    return (read_rollout(out / "rollouts" / name) for name in batch.accepted)


def _came(batch: IntakeSummary) -> str:
    if not batch.items:
        return "no file"
    first = batch.findings[batch.findings["fatal"]].iloc[0]["message"]
    return f"{len(batch.items)} files that all fail; the first: {first}"


if __name__ == "__main__":
    run_stage(main)
