"""Learning curves of several trainings beside each other: a picture over minutes, and when each reached a level.

    python -m benchmarks.learning_curves "PPO=results/ppo" "world model, seed 0=results/world_model" --out curves.svg

Minutes count from the training's start, as `curve.csv` has them: what passes before the first iteration is done
(compiling, loading kernels, recording graphs) is drawn dotted and printed. Success is of training episodes, at the
curriculum's threshold of the moment, so that it may fall while the policy comes nearer: the key bodies' error beside it
does not depend on the threshold. Both are means of the last ten iterations.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from bumblebee.learning.learner import CURVE

LABELS = {"success": "success of training episodes", "key_error": "key bodies' error [mm]"}
_LAST = 10  # iterations in a mean
_SHOWN = 250  # points of a drawn line


def read(folder: Path) -> pd.DataFrame:
    """A training's curve: minutes, success, key_error [mm] and threshold [m], a row an iteration.

    Raises:
        BadInput: if there is none in the folder.
    """
    file = Path(folder) / CURVE
    wanted = ["seconds", "success", "key_error", "threshold"]
    if not file.is_file():
        raise BadInput(file, "the curve of a training", "no such file")
    curve = pd.read_csv(file)
    if missing := [name for name in wanted if name not in curve]:
        raise BadInput(file, f"columns {', '.join(wanted)}", f"no {', '.join(missing)}")
    made = curve[["success", "key_error"]].rolling(_LAST, min_periods=1).mean()
    made["key_error"] *= 1e3
    return made.assign(minutes=curve["seconds"] / 60, threshold=curve["threshold"])


def reached(curve: pd.DataFrame, success: float, key_error: float) -> tuple[float | None, float | None]:
    """Minutes until a success at the last threshold, and until an error [mm] of whole means; None where not reached."""
    last = curve["threshold"].rolling(_LAST).max() <= curve["threshold"].iloc[-1]
    near = (curve.index >= _LAST) & (curve["key_error"] <= key_error)
    found = (curve["minutes"][rows] for rows in (last & (curve["success"] >= success), near))
    first, second = (float(minutes.iloc[0]) if len(minutes) else None for minutes in found)
    return first, second


def table(curves: Mapping[str, pd.DataFrame], success: float, key_error: float) -> str:
    """Markdown, a row a training: the wait before the first iteration, when it reached the levels, and its end."""
    levels = f"success {success:g} at the last threshold | key bodies {key_error:g} mm"
    lines = [f"| | first iteration done | {levels} | at the end |", "|---|---|---|---|---|"]
    for name, curve in curves.items():
        cells = [f"{curve['minutes'].iloc[0]:.1f} min"]
        cells += ["not reached" if at is None else f"{at:.1f} min" for at in reached(curve, success, key_error)]
        end = curve.iloc[-1]
        cells.append(f"{end['success']:.2f}, {end['key_error']:.0f} mm after {end['minutes']:.1f} min")
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines)


def draw(curves: Mapping[str, pd.DataFrame], out: Path) -> None:
    """Write the picture: success and error over minutes; trainings whose names agree before a comma share a colour."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "learners"
    from matplotlib import pyplot

    kinds = list(dict.fromkeys(name.split(",")[0] for name in curves))
    drawn = dict.fromkeys(kinds, 0)
    figure, axes = pyplot.subplots(1, len(LABELS), figsize=(10.3, 3.4))
    for name, curve in curves.items():
        kind = name.split(",")[0]
        look = {"color": f"C{kinds.index(kind)}", "linestyle": ("-", "--", ":", "-.")[drawn[kind] % 4]}
        drawn[kind] += 1
        few = curve.iloc[:: max(len(curve) // _SHOWN, 1)]
        for axis, column in zip(axes, LABELS, strict=True):
            axis.plot(few["minutes"], few[column], linewidth=1.1, label=name, **look)
            before = [0, few["minutes"].iloc[0]], [few[column].iloc[0]] * 2
            axis.plot(*before, color=look["color"], linewidth=0.6, dashes=(1, 2))
    for axis, label in zip(axes, LABELS.values(), strict=True):
        axis.set(xlabel="minutes from the training's start", ylabel=label, ylim=(0, None), xlim=(0, None))
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=8, frameon=False, loc="lower right")
    figure.tight_layout()
    figure.savefig(out, metadata={"Date": None})
    pyplot.close(figure)


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learning_curves", description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="+", metavar="NAME=FOLDER", help="trainings with curve.csv")
    parser.add_argument("--out", type=Path, help="SVG file for the picture; without, the table alone is printed")
    parser.add_argument("--success", type=float, default=0.66)
    parser.add_argument("--key-error", type=float, default=46.0, help="mm")
    return parser.parse_args(arguments)


def run(options: argparse.Namespace) -> int:
    """Print the table, and draw the picture where one is asked for."""
    curves = {}
    for text in options.runs:
        name, equals, folder = text.partition("=")
        if not equals:
            raise BadInput("a run", "NAME=FOLDER", repr(text))
        curves[name] = read(Path(folder))
    if options.out:
        draw(curves, options.out)
    print(table(curves, options.success, options.key_error))
    return 0


if __name__ == "__main__":
    raise SystemExit(guarded(lambda: run(parse())))
