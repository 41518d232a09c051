"""Sections about the policies: how they learned and follow, which step of the loop helped, what is published."""

from bumblebee.report.charts.curves_chart import curves_charts
from bumblebee.report.charts.gains_chart import gains_chart
from bumblebee.report.charts.success_figure import pick, success_grid
from bumblebee.report.names import everyone, label, pair, reference
from bumblebee.report.page import Block, Section, heading, note, table, text
from bumblebee.report.results import Json, LoopResults
from bumblebee.report.wording import MEASURES, SAME_FILE, change, number, percent, plural

NOT_YOURS = (
    "Policies were evaluated in simulation only: on the declared model and on a stand-in robot with made-up effects. "
    "Neither is your robot, on which only the measured rollouts were taken."
)
BEGAN = {
    "shipped": "Training began from the policy that comes along, which real motions on a GPU had taught most of this "
    "already; motions held out here may be among what it saw (bumblebee/learning/pretrained/README.md).",
    "own": "Training began from a policy that was brought along; motions held out here may be among what it saw.",
}
STARTS = {"scratch": "from scratch", "shipped": "from the policy that comes along", "own": "from your own policy"}
ENGINES = {"stand_in": "on the stand-in robot", "nominal": "on the declared model"}
_CLAIMS = (
    "Paired by motion. Better or worse only if the 95 % interval leaves out zero and p is at most 0.05. Success: more "
    "is better. MPJPE, MPKPE: less is better, over episodes that both followed to the end."
)


def engines(results: LoopResults) -> list[str]:
    """Engines that were evaluated: the stand-in first where it is the robot, last where there is a real one."""
    there = {entry["engine"] for entry in results.evaluation["results"]}
    return [engine for engine in (reversed(ENGINES) if results.real_robot else ENGINES) if engine in there]


def training_section(results: LoopResults) -> Section:
    """Learning curves."""
    base = {n: c for n, c in results.curves.items() if n == "base"}
    experts = {n: c for n, c in results.curves.items() if n.startswith("expert")}
    rest = {n: c for n, c in results.curves.items() if n == "generalist"}
    blocks: list[Block] = [note(BEGAN[results.began])] if results.began in BEGAN else []
    start = STARTS[results.began]
    groups = {
        f"Base policy, {start}": (
            base,
            "Episodes start anywhere in a clip, with noise and a shrinking threshold.",
        ),
        "Experts": (experts, "r0: fine-tuned from the base policy; r1 and later: refined in the corrected simulator."),
        "Generalist": (rest, "By DAgger from the final experts."),
    }
    for name, (curves, caption) in groups.items():
        blocks += curves_charts(curves, name, " ".join([caption, *_by(results, list(curves))]))
    return Section("training", "Learning", tuple(blocks))


def _by(results: LoopResults, policies: list[str]) -> list[str]:
    """A sentence for each learner: which of these policies it trained."""
    told = [(results.learners[name], name) for name in policies if name in results.learners]
    named = {learner: [name for by, name in told if by == learner] for learner, _ in told}
    return [f"Learner {learner}: {', '.join(names)}." for learner, names in named.items()]


def success_section(results: LoopResults) -> Section:
    """Success, MPJPE and MPKPE by policy, engine and split; by family and cluster; paired comparisons."""
    entries, policies = results.evaluation["results"], everyone(results)
    contract = results.contract
    blocks: list[Block] = [
        text(
            f"Frozen evaluation {results.evaluation['contract_sha256'][:12]}: "
            f"{plural(len(contract['motions']), 'motion')}, seed{'' if len(contract['seeds']) == 1 else 's'} "
            f"{', '.join(map(str, contract['seeds']))}. Success: no fall, and every key body within the "
            "threshold of its reference from the first frame to the last. Intervals are over motions: episodes of "
            "one motion are not independent."
        )
    ]
    if results.real_robot:
        blocks.append(text(NOT_YOURS))
    named = {policy: label(results, policy) for policy in policies}
    blocks += [heading("Which step helped"), *_steps(results)]
    for engine in engines(results):
        blocks += [heading(f"{ENGINES[engine]}".capitalize()), *success_grid(entries, named, engine, "family")]
        blocks += [*success_grid(entries, named, engine, "cluster"), _rates(results, policies, engine)]
    return Section("success", "Success", tuple(blocks))


def _steps(results: LoopResults) -> list[Block]:
    """Success on the robot as a chart; every paired comparison in all three measures folded below it."""
    parts = {"all": "all", "test": "held out"}
    where = {engine: name.removeprefix("on the ") for engine, name in ENGINES.items()}
    rows = [
        (
            f"{label(results, c['from'])} → {label(results, c['to'])}",
            where[engine],
            parts[c["split"]],
            str(c["motions"]),
            *_three(c),
        )
        for engine in engines(results)
        for c in results.evaluation["comparisons"]
        if c["engine"] == engine and c["split"] in parts
    ]
    header = ("step", "where", "motions", "n", *(name for name, *_ in MEASURES.values()))
    charts = [
        block for engine in engines(results) for block in gains_chart(_loop_steps(results, engine), ENGINES[engine])
    ]
    return [
        *charts,
        note(_CLAIMS),
        table(header, rows, "", "steps of the loop", folded="All comparisons, all measures"),
    ]


def _loop_steps(results: LoopResults, engine: str) -> list[tuple[str, Json]]:
    """The comparisons that are steps of the loop or hold a step against its control, over all motions."""
    first = reference(results.evaluation)
    return [
        (f"{label(results, c['from'])} → {label(results, c['to'])}", c)
        for c in results.evaluation["comparisons"]
        if c["engine"] == engine and c["split"] == "all" and (c["from"] != first or c["to"] == "generalist")
    ]


def _three(comparison: Json) -> tuple[str, ...]:
    if comparison.get("unchanged"):
        return (SAME_FILE, "–", "–")
    return tuple(change(comparison, measure) for measure in MEASURES)


def _rates(results: LoopResults, policies: list[str], engine: str) -> Block:
    """Each policy's numbers, and its success against what the loop began with: what the loop added."""
    rows, first = [], reference(results.evaluation)
    for policy in policies:
        for split, name in (("train", "training"), ("test", "held out")):
            found = pick(results.evaluation["results"], policy=policy, engine=engine, split=split, group="all")
            against = pair(results.evaluation, first, policy, engine, split)
            gain = "–" if against is None else change(against)
            for e in found:
                errors = (number(e["mpjpe_rad"]), number(e["mpkpe_mm"], 0))
                rows.append((label(results, policy), name, str(e["n"]), percent(e["success"]), gain, *errors))
    against_first = f"success against {label(results, first)}"
    header = ("policy", "motions", "episodes", "success", against_first, "MPJPE [rad]", "MPKPE [mm]")
    caption = (
        "MPJPE, MPKPE: mean error of joint angles and of key bodies' positions, over all episodes up to their end. "
        "Their intervals come from few motions where they are wide."
    )
    folded = "Numbers of training and held-out motions, with errors"
    return table(header, rows, caption, f"success {ENGINES[engine]}", folded)


def registry_section(results: LoopResults) -> Section:
    """Names, versions and aliases in the MLflow registry."""
    rows = []
    for name, model in results.published.get("models", {}).items():
        versions = ", ".join(str(version) for version in model["versions"])
        champion = "–" if model.get("champion") is None else f"version {model['champion']}"
        digest = str(model["onnx_sha256"])[:12]
        rows.append((label(results, name), str(model["version"]), versions, champion, model["reason"], digest))
    blocks: tuple[Block, ...] = (
        table(("model", "newest", "in this run", "@champion", "why", "ONNX sha256"), rows, "", "registered models"),
        note("Look one up: mlflow.pyfunc.load_model('models:/generalist@champion'), with the server of `make serve`."),
    )
    return Section("registry", "Registry", blocks)
