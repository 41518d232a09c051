"""The page after a run: how it ended, what came, how the robot followed, and the way to findings."""

from collections.abc import Mapping
from pathlib import Path
from shlex import join

import numpy as np

from bumblebee.measured.overview_plots import Trace, data_uri, plot
from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.report.page import Block, Section, bullets, image, note, pairs, render, table, text, warning

_CURVES = 6  # joints that are drawn: those that follow worst


def after_page(
    reason: str, numbers: Mapping[str, int], missed: int, rollout: Path | None, out: Path, workspace: Path
) -> str:
    """The page's HTML.

    Args:
        reason: rule that ended the run; "" for good order.
        numbers: rule -> ticks in which it asked for anything.
        missed: ticks of the guard.
        rollout: what was measured; None where the policy never carried the robot.
        out: the dataset's folder.
        workspace: of the loop, whose gates people answer.
    """
    measured = None if rollout is None else read_rollout(rollout)
    sections = [Section("end", "How it ended", tuple(_end(reason, numbers, missed)))]
    if measured is not None:
        sections.append(Section("came", "What came", tuple(_came(measured))))
        sections.append(Section("next", "What next", tuple(_next(measured, out, workspace))))
    name = "a run" if measured is None else f"{measured.meta.get('motion', '')}, {measured.rollout_id}"
    return render("After a run", name, "", sections)


def _end(reason: str, numbers: Mapping[str, int], missed: int) -> list[Block]:
    how = warning(f"The rule {reason} ended it.") if reason else text("It ended in good order.")
    asked = [(name, f"{count:,}") for name, count in numbers.items()]
    counted = [table(("rule", "ticks in which it asked"), asked, "", "rules")] if asked else [text("No rule asked.")]
    return [how, text(f"Ticks of the guard that were missed: {missed}."), *counted]


def _came(measured: Rollout) -> list[Block]:
    meta = measured.meta
    facts = [
        ("rows", f"{measured.frames} at {measured.control_hz:g} Hz, {measured.frames / measured.control_hz:.1f} s"),
        ("operator", str(meta.get("operator", ""))),
        ("notes", str(meta.get("notes", "")) or "none"),
    ]
    blocks = [pairs(("", ""), facts, "what came")]
    if measured.joint_target is None:
        return blocks
    error = np.sqrt(((measured.joint_target - measured.joint_pos) ** 2).mean(axis=0))
    worst = np.argsort(-error)[:_CURVES]
    blocks += [_curve(measured, int(joint), float(error[joint])) for joint in worst]
    said = "Commanded (grey) and measured (orange) of the joints that followed worst. A servo lags its target by what "
    return [*blocks, note(f"{said}it carries, so a distance alone is no fault.")]


def _curve(measured: Rollout, joint: int, error: float) -> Block:
    assert measured.joint_target is not None
    name, time = measured.joints[joint], measured.time - measured.time[0]
    motion = str(measured.meta.get("motion", ""))
    trace = Trace(motion, name, error, time, measured.joint_target[:, joint], measured.joint_pos[:, joint])
    return image(data_uri(plot(trace, slide=False, headed=False)), name, f"{1000 * error:.0f} mrad RMS")


def _next(measured: Rollout, out: Path, workspace: Path) -> list[Block]:
    model, folder = str(out / "model.xml"), str(out)
    if measured.base_lin_vel is None:
        return [text("Without odometry there is no base_lin_vel, which gap and diagnose ask for of a floating base.")]
    commands = [
        ("where the model errs", ["bumblebee", "gap", model, folder]),
        ("which effects it lacks", ["bumblebee", "diagnose", model, folder, "--out", f"{folder}-found"]),
    ]
    more = []
    if (workspace / "dvc.yaml").is_file():
        asked = ["bumblebee", "gate", "list", "--workspace", str(workspace.resolve())]
        commands.append(("what the loop asks people, to approve, reject or ask for more", asked))
        more.append(
            note("The loop takes the folder by rollouts.source; its gate shows what came, and waits for people.")
        )
    said = bullets([f"{what}: {join(words)}" for what, words in commands])
    return [text("Look at the log before the next motion."), said, *more]
