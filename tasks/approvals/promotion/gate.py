"""The promotion of a model as a question to people: may this version take the alias champion?

Stage publish proposes it in data/published.json, with the figures that are shown; an answer holds for just these and
for the policy's ONNX file, by its hash. The alias moves with the last approval that is needed, and stays where it is
when somebody rejects the version or asks for more.
"""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash, read_json
from tasks import registry
from tasks.approvals import gate, words
from tasks.approvals.promotion.rule import CHAMPION
from tasks.running import paths


@dataclass(frozen=True)
class PromotionConfig(gate.GateConfig):
    """Who lets a version become champion."""

    section = "publish.promotion"

    mode: Literal["ask", "auto"] = "auto"
    """auto: the numbers decide alone; ask: where they let it through, people are asked, too."""


@dataclass(frozen=True)
class Promotion:
    """The question about one model, by its files."""

    workspace: Path
    """The folder with dvc.yaml and params.yaml."""
    model: str
    """Its name in the registry."""

    @property
    def approval(self) -> Path:
        """Where the request and its answer lie."""
        return self.workspace / "data" / "approvals" / f"promotion-{self.model}.json"

    @property
    def subject(self) -> dict[str, Any]:
        """Keys that tell its answers from others in the record."""
        return {"model": self.model}

    def seen(self) -> dict[str, Any]:
        """Proposal for the policy as its file is now; with the hash of all that.

        Raises:
            BadInput: where nothing is proposed.
        """
        known = proposals(self.workspace)
        if self.model not in known:
            do = "`bumblebee gate list` names what is asked; publish.promotion says whether it is."
            came = f"none (of {', '.join(known) or 'no model'})"
            raise BadInput(f"promotion of {self.model}", "a version that is proposed", came, do)
        shown = dict(known[self.model])
        file = self.workspace / str(shown.pop("folder")) / "policy.onnx"
        if file.is_file():
            shown["onnx_sha256"] = file_hash(file)
        text = json.dumps(shown, sort_keys=True)
        return {"sha256": hashlib.sha256(text.encode()).hexdigest(), **shown}

    def sha256(self) -> str:
        """The hash of it."""
        return str(self.seen()["sha256"])


def proposals(workspace: Path) -> dict[str, dict[str, Any]]:
    """Proposals of stage publish, by model."""
    path = workspace / paths.PUBLISHED
    if not path.exists():
        return {}
    content = read_json(path, gate.SUMMARY_LIMITS)
    models = content.get("models") if isinstance(content, dict) else None
    if not isinstance(models, dict):
        raise BadInput(path, "what stage publish writes", "something else", "Run `dvc repro -sf publish`.")
    return {name: facts["proposal"] for name, facts in models.items() if "proposal" in facts}


def questions(workspace: Path) -> Iterator[Promotion]:
    """Every model of which a version is proposed."""
    return (Promotion(workspace, name) for name in proposals(workspace))


def settle(place: Promotion, table: dict[str, Any]) -> bool:
    """Move the alias to a version that is approved, in the registry of this folder; whether it moved."""
    version = str(table["seen"]["version"])
    if table["status"] != "approved" or registry.champion_version(place.model) == version:
        return False
    require_as_shown(table)
    registry.set_alias(place.model, CHAMPION, version)
    registry.describe(place.model, registry.version_card(place.model, version))
    print(f"{place.model}: version {version} is champion", flush=True)
    return True


def require_as_shown(table: dict[str, Any]) -> None:
    """Refuse what is no more what was shown: another policy file, or another champion to compare with.

    Raises:
        BadInput: naming what changed.
    """
    seen, model, do = table["seen"], table["model"], "Publish again: `dvc repro -sf publish`."
    where = f"{words.title(table)}, version {seen['version']}"
    if (registry.version_tags(model, str(seen["version"])) or {}).get("onnx_sha256") != seen["onnx_sha256"]:
        raise BadInput(where, "the policy.onnx that was published", "another one", do)
    champion = registry.champion_version(model)
    if champion not in (seen["champion"], str(seen["version"])):
        expected = f"champion {seen['champion'] or 'none'}, with which it was compared"
        raise BadInput(where, expected, f"version {champion}" if champion else "none", do)


def require_no_champion(table: dict[str, Any]) -> None:
    """Refuse to hold back a version that has the alias already.

    Raises:
        BadInput: naming the version.
    """
    model, version = table["model"], str(table["seen"]["version"])
    if registry.champion_version(model) == version:
        do = f"To undo it move the alias {CHAMPION} back on MLflow's page of {model}."
        raise BadInput(words.title(table), "a version that is not champion yet", f"version {version}, which is", do)
