"""Tags and texts of runs and versions, in the lengths that MLflow's tables hold."""

import hashlib
import json
import os
from collections.abc import Mapping
from typing import Any

from tasks.running.lineage import git_sha
from tasks.running.run_form import fitted

# Characters that MLflow's tables hold; what is longer says so there and is whole in the file that it names.
LONGEST_PARAM, LONGEST_TAG, LONGEST_DESCRIPTION = 6000, 5000, 5000
LINEAGE, CARD = "lineage.json", "README.md"


def origin_tags(origin: str) -> dict[str, str]:
    """Tags to filter runs by: commit, DVC's stage, and the hash of all inputs, which are in lineage.json."""
    digest = hashlib.sha256(origin.encode()).hexdigest()
    return {"git_sha": git_sha(), "dvc_stage": os.environ.get("DVC_STAGE", ""), "lineage": digest}


def fitted_tags(tags: Mapping[str, object]) -> dict[str, str]:
    """Tags as texts; one that is too long is cut, with a word on where it is whole."""
    return {key: fitted(str(value), LONGEST_TAG, LINEAGE) for key, value in tags.items()}


def as_text(content: Mapping[str, Any]) -> str:
    """JSON, as files of a run have it."""
    return json.dumps(content, indent=1) + "\n"
