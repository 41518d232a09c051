"""One finished run with what it was made from."""

import hashlib
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tasks.registry.labels import LINEAGE, LONGEST_PARAM, as_text, fitted_tags, origin_tags
from tasks.registry.store import experiment_name, prepare
from tasks.running.lineage import current_stage, inputs_of_stage, lineage, place
from tasks.running.outputs import MANIFEST, copied, manifest
from tasks.running.run_form import Metric, by_step, fitted, flatten, metric_name, read_curve


def log_run(
    stage: str,
    cluster: str | None,
    round: int | None,
    params: object,
    metrics: Mapping[str, Metric],
    curve: Path | None,
    tags: dict[str, str],
    outputs: Sequence[Path] | None = None,
    begun: float | None = None,
) -> str:
    """Write one finished run with its outputs (`tasks/running/outputs.py`); returns its id.

    Args:
        stage: the stage's name.
        cluster: the cluster, where the stage has one.
        round: the round, where the stage has one.
        params: the configuration (dataclass or mapping).
        metrics: numbers, each alone or by step.
        curve: a CSV file whose first column is the step.
        tags: anything else worth searching for.
        outputs: files and folders, relative to the workspace; None: those of the stage that DVC runs.
        begun: when the stage began, in seconds since 1970; None: now.

    A stage that DVC runs again with equal inputs, as after a kill, takes the place of what it has written before.
    """
    from mlflow.entities import Metric as Point
    from mlflow.entities import Param, RunTag

    client = prepare()
    experiment = client.get_experiment_by_name(experiment_name())
    assert experiment is not None
    title = " ".join(str(part) for part in (stage, cluster, f"r{round}" if round is not None else None) if part)
    settings_of = flatten(params)
    origin = as_text(lineage(inputs_of_stage(), settings_of, settings_of.get("seed")))
    record = hashlib.sha256(f"{place()} {title} {origin}".encode()).hexdigest()
    if "DVC_STAGE" in os.environ:
        for earlier in client.search_runs([experiment.experiment_id], f"tags.record = '{record}'"):
            client.delete_run(earlier.info.run_id)
    now = time.time()
    start, end = (int(1000 * moment) for moment in (now if begun is None else begun, now))
    run = client.create_run(experiment.experiment_id, start, run_name=title, tags={"record": record})
    run_id = run.info.run_id
    labels = {"stage": stage, **origin_tags(origin), **tags}
    labels |= {key: str(value) for key, value in (("cluster", cluster), ("round", round)) if value is not None}
    numbers = [*by_step(metrics), *(read_curve(curve) if curve else [])]
    points = [Point(metric_name(name), value, end, step) for name, step, value in numbers]
    settings = [Param(key, fitted(value, LONGEST_PARAM, LINEAGE)) for key, value in settings_of.items()]
    written = [RunTag(key, value) for key, value in fitted_tags(labels).items()]
    for kind, entries, most in (("metrics", points, 1000), ("params", settings, 100), ("tags", written, 100)):
        for first in range(0, len(entries), most):
            some: dict[str, Any] = {kind: entries[first : first + most]}
            client.log_batch(run_id, **some)
    client.log_text(run_id, origin, LINEAGE)
    made = manifest(current_stage()[1] if outputs is None else outputs)
    client.log_text(run_id, as_text(made), MANIFEST)
    for file in copied(made):
        client.log_artifact(run_id, str(file), os.path.dirname(file))
    client.set_terminated(run_id, end_time=end)
    return str(run_id)
