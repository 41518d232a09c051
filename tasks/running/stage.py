"""Services that every stage shares: its command line, its parameters, outputs that appear whole or not at all.

A stage's module reads:

    def main(cluster: str, round: int) -> None:      # options --cluster and --round; no parameters, no options
        config = load("experts", ExpertConfig)       # the section of params.yaml, checked
        with output_folder(paths.expert(round, cluster)) as folder:
            ...                                      # write into `folder`; it is renamed at the end
        log_run("experts", cluster=cluster, round=round, params=config, metrics={...}, curve=...)

    if __name__ == "__main__":
        run_stage(main)
"""

import argparse
import errno
import hashlib
import inspect
import os
import shutil
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.last_line import disk_line, guarded
from tasks.lab.private import private_index
from tasks.lab.serve import read_tracking
from tasks.lab.servers import read_lab
from tasks.running import paths, recorder
from tasks.running.parent import end_with_parent
from tasks.running.run_form import Metric
from tasks.sections import check_once
from tasks.settings.params import load

__all__ = ["disk_line", "load", "log_run", "output_file", "output_folder", "run_stage", "scratch"]

_used_scratch: set[Path] = set()


def run_stage(main: Callable[..., object], argv: list[str] | None = None, *, logs: bool = True) -> None:
    """Run a stage's `main` from the command line and leave the process with its status.

    The parameters of `main` become options (`cluster: str` is `--cluster`, `round: int` is `--round`). Bad input
    and a full disk end in one line on standard error and status 2, any other exception in one line that names a log
    file with its traceback, and status 1. When DVC runs a stage that `logs` a run, MLflow is made ready beside it.
    """
    options = _parser(main).parse_args(argv)
    if "DVC_STAGE" in os.environ:
        if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        end_with_parent()
        if logs and os.environ.get("RANK", "0") == "0":  # of processes that train together, one logs
            recorder.start()
    if status := guarded(lambda: _run(main, vars(options))):
        raise SystemExit(status)
    for folder in _used_scratch:
        shutil.rmtree(folder, ignore_errors=True)
    _used_scratch.clear()


def _run(main: Callable[..., object], options: dict[str, object]) -> None:
    try:
        if "DVC_STAGE" in os.environ:
            check_once()
            if "DVC_ROOT" in os.environ:
                private_index(Path(os.environ["DVC_ROOT"]), remake=False)  # DVC has it open
        main(**options)
    except Exception as error:
        if "database or disk is full" in str(error):  # how SQLite says it, through whichever library
            raise OSError(errno.ENOSPC, "", ".servers") from error
        if not isinstance(error, BadInput) and (away := _labs_servers_away(error)):
            raise away from error
        raise


def _labs_servers_away(error: Exception) -> BadInput | None:
    """The one line for a stage that asks the registry itself, as publish does, of a lab that does not answer."""
    away = recorder.away(" ".join(f"{type(error).__name__}: {error}".split()))
    shared = away and (read_lab(Path.cwd()) is not None or read_tracking(Path.cwd()) is not None)
    return away if shared else None


def _parser(main: Callable[..., object]) -> argparse.ArgumentParser:
    module = inspect.getmodule(main)
    name = getattr(getattr(module, "__spec__", None), "name", None) or main.__module__
    summary = (module.__doc__ or "").strip().splitlines()[0] if module and module.__doc__ else None
    parser = argparse.ArgumentParser(prog=f"python -m {name}", description=summary)
    for parameter in inspect.signature(main).parameters.values():
        kind = int if parameter.annotation in (int, "int") else str
        required = parameter.default is inspect.Parameter.empty
        default = None if required else parameter.default
        flag = "--" + parameter.name.rstrip("_").replace("_", "-")
        parser.add_argument(flag, dest=parameter.name, type=kind, required=required, default=default)
    return parser


@contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """A folder to write a stage's output into: it takes the place of `path` at the end, whole, or never."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = target.parent / f".{target.name}.writing"
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    try:
        yield fresh
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        raise
    if target.exists():
        old = target.parent / f".{target.name}.old"
        shutil.rmtree(old, ignore_errors=True)
        target.rename(old)
        fresh.rename(target)
        shutil.rmtree(old)
    else:
        fresh.rename(target)


@contextmanager
def output_file(path: str | Path) -> Iterator[Path]:
    """A file to write a stage's output into, whole or never; the name to write to keeps the suffix."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = target.parent / f".writing-{target.name}"
    try:
        yield fresh
        fresh.replace(target)
    finally:
        fresh.unlink(missing_ok=True)


def scratch(stage: str, *inputs: object) -> Path:
    """The folder for checkpoints that survive a kill: `.scratch/<stage>/`.

    It is emptied here when what the stage reads has changed since (DVC's dependencies when DVC runs the stage, else
    `inputs`: paths and configurations), and removed by `run_stage` when the stage completes.

    Args:
        stage: a name of its own for each instance, such as "experts-r0-c1".
        inputs: paths or configurations that the checkpoint depends on, where DVC does not say so.
    """
    folder = paths.SCRATCH / stage
    key = _inputs_key(inputs)
    stamp = folder / ".inputs"
    if folder.exists() and (not stamp.exists() or stamp.read_text() != key):
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if not stamp.exists():  # processes that train together come here at once
        stamp.write_text(key)
    _used_scratch.add(folder)
    return folder


def _inputs_key(inputs: tuple[object, ...]) -> str:
    from tasks.running.lineage import current_inputs, path_hash

    parts = [f"{name} {value}" for name, value in sorted(current_inputs().items())]
    for item in inputs:
        parts.append(path_hash(item) if isinstance(item, Path) else repr(item))
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def log_run(
    stage: str,
    *,
    cluster: str | None = None,
    round: int | None = None,
    params: object = None,
    metrics: Mapping[str, Metric] | None = None,
    curve: Path | None = None,
    tags: dict[str, str] | None = None,
) -> None:
    """Write the stage's run to MLflow: parameters, numbers, learning curve, and what it was made from.

    The run also has the stage's outputs as dvc.yaml names them, so the last of them must be written before.

    Args:
        stage: the stage's name.
        cluster: the cluster, where the stage has one.
        round: the round, where the stage has one.
        params: the configuration (dataclass or mapping); nested fields are flattened with dots.
        metrics: numbers, each alone or by step.
        curve: a CSV file whose first column is the step and each other one a metric.
        tags: anything else worth searching for.
    """
    recorder.record(
        {
            **{"stage": stage, "cluster": cluster, "round": round, "params": params},
            **{"metrics": metrics or {}, "curve": curve, "tags": tags or {}},
        }
    )
