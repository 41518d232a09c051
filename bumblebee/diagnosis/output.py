"""Results on disk, whole or not at all; where their place fails in the end they are kept elsewhere.

A diagnosis is diagnosis.json, model.xml, effects.yaml and report.html; a gap report gap.json and gap.html.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco

from bumblebee.diagnosis.diagnose import Diagnosis
from bumblebee.diagnosis.gap import Gap, gap_page
from bumblebee.diagnosis.places import DIAGNOSIS, GAP, Result, refuse_file, refuse_folder
from bumblebee.diagnosis.report import NO_INLAY, Inlay, examples, render_report
from bumblebee.diagnosis.simulation import REFUSALS, effects_in_words
from bumblebee.errors import BadInput
from bumblebee.io.write import kept, write_file, write_folder
from bumblebee.measured.model_file import name_assets_in_full
from bumblebee.sim.effects import Effect, add_to_spec, effects_yaml


def write_diagnosis(diagnosis: Diagnosis, out: Path, overwrite: bool = False, replays: Inlay = NO_INLAY) -> None:
    """Write all four files, or none.

    Args:
        diagnosis: what was found.
        out: the folder.
        overwrite: replace an earlier diagnosis and nothing else.
        replays: 3D replays for the page.
    """
    _write(Path(out), DIAGNOSIS, overwrite, contents(diagnosis, replays))


def write_gap(gap: Gap, out: Path, overwrite: bool = False) -> None:
    """Write both files, or none; `overwrite` replaces an earlier gap report and nothing else."""
    _write(Path(out), GAP, overwrite, {"gap.json": as_json(gap.document), "gap.html": gap_page(gap)})


def write_errors(errors: dict[str, Any], out: Path, overwrite: bool = False) -> None:
    """Write the errors that `replay` found; `overwrite` replaces an earlier file of them and nothing else."""
    out = Path(out)
    try:
        refuse_file(out, overwrite)
        write_file(out, as_json(errors))
    except BadInput as error:
        raise _elsewhere(error, out, {out.name: as_json(errors)}) from None


def fill(diagnosis: Diagnosis, folder: Path, replays: Inlay = NO_INLAY) -> None:
    """Write the four files into an existing folder."""
    for name, text in contents(diagnosis, replays).items():
        (folder / name).write_text(text, encoding="utf-8")


def contents(diagnosis: Diagnosis, replays: Inlay = NO_INLAY) -> dict[str, str]:
    """Text of the four files by name."""
    rules = diagnosis.problem.thresholds.report
    shown = examples(diagnosis.session, diagnosis.effects, rule=rules.example_windows)
    xml, notes = corrected_xml(diagnosis.session.spec, diagnosis.effects)
    document = {**diagnosis.document, "notes": [*diagnosis.document["notes"], *notes]}
    return {
        "diagnosis.json": as_json(document),
        "effects.yaml": effects_yaml(diagnosis.effects),
        "model.xml": xml,
        "report.html": render_report(document, shown, rules, replays),
    }


def corrected_xml(declared: mujoco.MjSpec, effects: Sequence[Effect]) -> tuple[str, list[str]]:
    """The declared model with every native effect, checked by loading it in plain MuJoCo; and what it cannot carry.

    An effect that cannot be written as MJCF costs its place in this file, with a note, and nothing else.
    """
    try:
        return _with_effects(declared, effects), []
    except REFUSALS:
        carried: list[Effect] = []
        notes = []
        for effect in effects:
            try:
                _with_effects(declared, [*carried, effect])
                carried.append(effect)
            except REFUSALS as error:
                told = " ".join(str(error).split())
                notes.append(f"model.xml is without {effects_in_words([effect])}, which effects.yaml has: {told}")
        return _with_effects(declared, carried), notes


def _with_effects(declared: mujoco.MjSpec, effects: Sequence[Effect]) -> str:
    spec = declared.copy()
    name_assets_in_full(spec)
    add_to_spec(spec, effects)
    spec.compile()
    return spec.to_xml()


def as_json(document: dict[str, Any]) -> str:
    """Text of a document; numbers that are none are an error."""
    return json.dumps(document, indent=1, allow_nan=False)


def _write(out: Path, result: Result, overwrite: bool, files: Mapping[str, str]) -> None:
    try:  # minutes have passed since the command looked: something else may lie there now
        refuse_folder(out, result, overwrite)
    except BadInput as error:
        raise _elsewhere(error, out, files) from None
    write_folder(out, files)


def _elsewhere(error: BadInput, out: Path, files: Mapping[str, str]) -> BadInput:
    return BadInput(error.where, error.expected, error.came, kept(out.name, files))
