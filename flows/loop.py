"""The loop as a Prefect flow: the stages of dvc.yaml, clusters side by side, a person at each gate.

DVC decides what is stale; Prefect decides what runs beside what and shows it. Every task is one stage in a process
of its own, brought up to date by DVC; Prefect's own cache is off, so that there is one.
"""

import logging
import os
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, cast

from prefect import flow, get_run_logger, runtime, task
from prefect.cache_policies import NO_CACHE
from prefect.futures import PrefectFuture
from prefect.states import Cancelled, Completed, Failed, State
from prefect.task_runners import TaskRunner, ThreadPoolTaskRunner

from bumblebee.errors import BadInput
from bumblebee.last_line import full_disk
from flows import gpus, progress
from flows.environment import SERVERS, environment, without_login
from flows.gates import gate_question
from flows.owned import require_own
from flows.runs import recorded
from flows.stages import Stage, changed_stages, downstream, read_stages, to_run
from flows.terminal import NOTICE, took
from tasks.lab.servers import on_cluster
from tasks.settings import params

ON_CLUSTER = 32  # stages that may wait for a machine at once; each is a process here
KEPT = 5  # last lines of a failed stage that its error repeats


def is_news(record: logging.LogRecord) -> bool:
    """Whether a line of Prefect's own says more than `run_stage` says of a stage that failed."""
    return not record.getMessage().startswith(("Task run failed with state", "Finished in state Failed("))


logging.getLogger("prefect.task_runs").addFilter(is_news)
WAITING = "WaitingForAnswer"  # name of the state of a run that ended at a gate
at_end: Callable[[State[Any]], None] = lambda state: None  # noqa: E731  (flows.walk puts its own here)


@task(task_run_name="{title}", cache_policy=NO_CACHE, persist_result=False, retries=0)
def run_stage(title: str, name: str, workspace: str) -> State[Any]:
    """Bring one stage up to date in a process of its own; its output goes to the log line by line.

    A failure is a state and no exception: the stage has said what is wrong, a traceback of ours would bury it.
    """
    log, folder, begun = get_run_logger(), Path(workspace), time.monotonic()
    command = [sys.executable, "-m", runner_of(folder), name]
    last: deque[str] = deque(maxlen=KEPT)
    with (
        progress.stage(workspace, name) as told,
        devices_of(folder, name) as devices,
        subprocess.Popen(
            command,
            cwd=workspace,
            env=without_login(environment(folder)) | devices,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        ) as process,
    ):
        assert process.stdout is not None
        for line in process.stdout:
            told["worked"] |= line.startswith("Running stage")
            if line.strip() and not is_chatter(line):
                last.append(line.rstrip())
                log.info(line.rstrip())
        told["worked"] &= process.wait() == 0
    spent = took(time.monotonic() - begun)
    if process.returncode:
        words = " / ".join(last)
        log.error(f"failed after {spent}: {words}")
        return Failed(message=f"{title}: {words}")
    log.log(NOTICE, f"done in {spent}" if told["worked"] else "is up to date")
    return Completed()


def runner_of(workspace: Path) -> str:
    """The module that brings a stage up to date: on this machine, or on one of the lab's Ray cluster."""
    return "flows.cluster.away" if on_cluster(workspace) else "flows.reproduce"


def devices_of(workspace: Path, stage: str) -> AbstractContextManager[dict[str, str]]:
    """The variable that gives a stage GPUs of this machine, while it runs; on a cluster Ray does it."""
    count = 0 if on_cluster(workspace) else gpus.wanted_by(workspace, stage)
    return gpus.lent(count, gpus.usable() if count else [])


def is_chatter(line: str) -> bool:
    """Lines of DVC that help nobody who watches the whole loop."""
    chatter = ("Running stage", "> python", "Updating lock file", "Generating lock file", "Use `dvc push`")
    advice = ("To track the changes with git", "git add dvc.lock", "To enable auto staging", "core.autostage")
    pushed = (" file pushed", " files pushed")  # to a lab's shared remote
    return line.startswith(chatter) or line.rstrip().endswith(pushed) or any(words in line for words in advice)


def run_name() -> str:
    """`demo, seed 4, round 1`: the workspace, the stand-in robot's seed, the last round; no more than is known."""
    folder = Path(os.environ.get("BUMBLEBEE_WORKSPACE", ".")).resolve()
    name = folder.name if folder.parent.name == "runs" else "demo"
    try:
        content = params.read(folder / params.FILE)
    except BadInput:
        return name  # the run itself says what is wrong
    seal, last = content.get("seal"), content.get("final_round")
    seed = seal.get("seed") if isinstance(seal, dict) and not (content.get("rollouts") or {}).get("source") else None
    return name + (f", seed {seed}" if seed is not None else "") + (f", round {last}" if last else "")


@flow(name="loop", flow_run_name=run_name, log_prints=False, persist_result=False, validate_parameters=False)
def loop(workspace: str = "") -> State[Any]:
    """Walk the stages; ends completed, failed, or named WaitingForAnswer where a gate has no answer yet.

    In the folder that BUMBLEBEE_WORKSPACE names, or in this one: dvc.yaml holds commands, so that who starts a run
    must not choose whose they are.

    Args:
        workspace: leave it empty; any other folder than the served one is refused.
    """
    folder = Path(os.environ.get("BUMBLEBEE_WORKSPACE", ".")).resolve()
    try:
        if workspace and Path(workspace).resolve() != folder:
            raise BadInput("the run's workspace", f"{folder} or none (runs work there only)", workspace)
        require_own(folder)
        with recorded(folder / SERVERS, runtime.flow_run.id):
            state = walk(folder)
    except BadInput as error:
        state = Failed(message=str(error))
    except Exception as error:
        line = full_disk(error)
        if line is None:
            at_end(Failed(message=f"{type(error).__name__}: {error}"))
            raise
        state = Failed(message=line)
    at_end(state)
    return state


def walk(folder: Path) -> State[Any]:
    """Start every stage that has work to do when those before it are done; how it ended."""
    log = get_run_logger()
    stages = read_stages(folder)
    busy = to_run(stages, changed_stages(folder))
    log.log(NOTICE, f"{len(busy)} of {len(stages)} stages have work to do" if busy else "everything is up to date")
    close = progress.begin(folder, stages, busy, log)
    running: dict[str, PrefectFuture[Any]] = {}
    waiting: str | None = None
    for stage in gates_last(stages):
        if stage.name not in busy:
            continue
        if waiting is not None and stage.name in downstream(stages, waiting):
            continue
        before = [running[name] for name in sorted(stage.needs) if name in running]
        if stage.kind == "gate" and not any(failed(future) for future in before):
            question = gate_question.hold(folder, stage)
            if question is not None:
                waiting = stage.name
                log.warning(question)
                continue
        running[stage.name] = run_stage.submit(
            stage.title, stage.name, str(folder.resolve()), return_state=False, wait_for=before
        )
    state = outcome(running, stages, waiting)
    close("done" if state.is_completed() else "waits for an answer" if waiting else "failed")
    return state


def failed(future: PrefectFuture[Any]) -> bool:
    """Wait for a stage; whether it did not complete."""
    future.wait()
    return not future.state.is_completed()


def outcome(running: dict[str, PrefectFuture[Any]], stages: list[Stage], waiting: str | None) -> State[Any]:
    """Wait for everything, so that all that can finish is saved; then how the run ended."""
    titles = {stage.name: stage.title for stage in stages}
    bad = [name for name, future in running.items() if failed(future)]
    causes = [name for name in bad if running[name].state.is_failed() or running[name].state.is_crashed()]
    if bad:
        kept = len(running) - len(bad)
        skipped = ", ".join(titles[name] for name in bad if name not in causes)
        text = f"{len(causes)} stage(s) failed, {kept} completed and are kept; not started: {skipped or 'none'}"
        return Failed(message="\n".join([text, *(running[name].state.message or name for name in causes)]))
    if waiting is not None:
        text = f"{titles[waiting]} waits for an answer; what came before it is kept"
        return Cancelled(name=WAITING, message=text)
    return Completed(message=f"{len(running)} stage(s) brought up to date")


def gates_last(stages: list[Stage]) -> list[Stage]:
    """A valid order in which a gate comes only after all that can start without it: holding it holds up nobody."""
    open_stages, order = list(stages), []
    done: set[str] = set()
    while open_stages:
        ready = [stage for stage in open_stages if stage.needs <= done]
        chosen = next((stage for stage in ready if stage.kind != "gate"), ready[0])
        order.append(chosen)
        done.add(chosen.name)
        open_stages.remove(chosen)
    return order


def runner(folder: Path) -> TaskRunner[PrefectFuture[Any]]:
    """A thread for each stage that may run at once; each only waits for its process, and on a cluster for a slot."""
    threads = ON_CLUSTER if on_cluster(folder) else os.cpu_count() or 1
    return cast("TaskRunner[PrefectFuture[Any]]", ThreadPoolTaskRunner(max_workers=threads))  # Prefect's is invariant
