"""A diagnosis on disk: diagnosis.json, model.xml, effects.yaml, report.html, in a folder that appears whole."""

import json
import os
import shutil
from pathlib import Path

from bumblebee.diagnosis.diagnose import Diagnosis
from bumblebee.diagnosis.example import examples
from bumblebee.diagnosis.report import render_report
from bumblebee.errors import BadInput
from bumblebee.measured.model_file import name_assets_in_full
from bumblebee.sim.effects import add_to_spec, write_effects


def refuse_existing(out: Path, overwrite: bool) -> None:
    """`BadInput` if `out` holds something and overwriting was not asked for."""
    if out.exists() and not out.is_dir():
        raise BadInput(out, "a folder to write", "a file")
    if out.is_dir() and any(out.iterdir()) and not overwrite:
        raise BadInput(
            out, "a folder that does not exist yet", "one with files in it", "Add --overwrite to replace it."
        )


def write_diagnosis(diagnosis: Diagnosis, out: Path, overwrite: bool = False) -> None:
    """Write all four files, or none."""
    out = Path(out)
    refuse_existing(out, overwrite)
    fresh = out.parent / f".{out.name}.{os.getpid()}.writing"
    fresh.mkdir(parents=True)
    try:
        fill(diagnosis, fresh)
        if out.exists():
            old = out.parent / f".{out.name}.{os.getpid()}.old"
            os.rename(out, old)
            os.rename(fresh, out)
            shutil.rmtree(old)
        else:
            os.rename(fresh, out)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def fill(diagnosis: Diagnosis, folder: Path) -> None:
    """The four files in an existing folder."""
    text = json.dumps(diagnosis.document, indent=1, allow_nan=False)
    (folder / "diagnosis.json").write_text(text)
    write_effects(folder / "effects.yaml", diagnosis.effects)
    (folder / "model.xml").write_text(corrected_xml(diagnosis))
    shown = examples(diagnosis.session, diagnosis.effects)
    (folder / "report.html").write_text(render_report(diagnosis.document, shown))


def corrected_xml(diagnosis: Diagnosis) -> str:
    """The declared model with every native effect; checked by loading it in plain MuJoCo."""
    spec = diagnosis.session.spec.copy()
    name_assets_in_full(spec)
    add_to_spec(spec, diagnosis.effects)
    spec.compile()
    return spec.to_xml()
