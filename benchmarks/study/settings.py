"""The file that holds a run to its settings and inputs."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from bumblebee.errors import BadInput

FROZEN = "study.json"


def freeze(out: Path, study: Any, **inputs: Any) -> str:
    """Write what the run in `out` is held to, or compare with what it began with; returns the hash of it.

    Args:
        out: the run's folder, made where there is none.
        study: its settings, a dataclass.
        inputs: plain values that results depend on beside them, such as the hash of the motions.

    Raises:
        BadInput: if the run began with others.
    """
    stated = json.loads(json.dumps({"study": asdict(study), **inputs}))
    path = Path(out) / FROZEN
    if path.exists():
        began = _read(path)
        different = sorted(_differences(began, stated))
        stated = began
        if different:
            came = ", ".join(different[:4]) + (f" and {len(different) - 4} more" if len(different) > 4 else "")
            raise BadInput(
                path, "the settings and motions that the run began with", f"others: {came}", "Use a new --out."
            )
    else:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(stated, indent=1) + "\n")
    return hashlib.sha256(json.dumps(stated, sort_keys=True).encode()).hexdigest()[:12]


def frozen(out: Path) -> dict[str, Any]:
    """Content that `freeze` wrote.

    Raises:
        BadInput: if nothing was begun there.
    """
    path = Path(out) / FROZEN
    if not path.exists():
        raise BadInput(path, "the settings of a run", "no such file", "Begin the run first.")
    return _read(path)


def _read(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise BadInput(path, "the settings of a run", f"{type(error).__name__}: {error}") from None


def _differences(began: Any, now: Any, place: str = "") -> list[str]:
    """Dotted places at which two nested mappings differ."""
    if isinstance(began, dict) and isinstance(now, dict):
        # What the run's beginning does not say is a setting of later code, at its default.
        keys = sorted(began)
        return [d for key in keys for d in _differences(began.get(key), now.get(key), f"{place}{key}.")]
    return [] if began == now else [f"{place.rstrip('.')} {yaml.safe_dump(began, default_flow_style=True).split()[0]}"]
