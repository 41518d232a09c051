"""Drop the motions that break a kinematic rule: data/motions -> data/filtered, with drops.csv saying why."""

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.motion.filter import FilterConfig, filter_clips
from bumblebee.motion.store import read_library, write_library
from tasks import paths
from tasks.stage import load, log_run, output_folder, run_stage


def main() -> None:
    """Filter the library; the result is a library of its own."""
    config = load("filter", FilterConfig)
    clips = read_library(paths.MOTIONS)
    kept, drops = filter_clips(clips, config)
    tell(len(clips), drops)
    if not kept:
        came = f"all {len(clips)} dropped; the first: {drops['motion'].iloc[0]}: {drops['explanation'].iloc[0]}"
        raise BadInput(paths.MOTIONS, "at least one motion within the limits", came, "Check the limits under `filter`.")
    with output_folder(paths.FILTERED) as folder:
        write_library(folder, kept)
        drops.to_csv(folder / "drops.csv", index=False)
    log_run("filter", params=config, metrics=metrics(len(clips), drops), artifacts=[paths.FILTERED / "drops.csv"])


def metrics(before: int, drops: pd.DataFrame) -> dict[str, float]:
    """Counts for MLflow: kept, dropped, and dropped by rule."""
    dropped = drops["motion"].nunique()
    by_rule = {f"dropped/{rule}": float(count) for rule, count in drops["rule"].value_counts().items()}
    return {"kept": before - dropped, "dropped": dropped, **by_rule}


def tell(before: int, drops: pd.DataFrame) -> None:
    """One line of counts, one for each rule broken with its worst case."""
    dropped = drops["motion"].nunique()
    print(f"{before - dropped} of {before} clips kept, {dropped} dropped -> {paths.FILTERED}")
    for rule, group in drops.groupby("rule"):
        worst = group.loc[group["value"].idxmax()]
        print(f"{rule}: {len(group)}; the worst is {worst['motion']}: {worst['explanation']}")


if __name__ == "__main__":
    run_stage(main)
