"""Does one step of a run; started by `benchmarks.method run`.

python -m benchmarks.method.work train declared/own/c0 --settings world_model --motions ... --robots ... --out ...
"""

import argparse
from pathlib import Path

from benchmarks.method.on_robot import OnRobot
from benchmarks.method.plan import DONE
from benchmarks.method.settings import NAMED, chosen
from benchmarks.method.training import Training
from benchmarks.method.trying import Trying
from benchmarks.study.motions import read_motions
from benchmarks.study.steps import GOES_ON, deadline
from bumblebee.errors import EXIT_BAD_INPUT, BadInput


def do(options: argparse.Namespace) -> bool:
    """Do the step; whether it is done."""
    method, motions = chosen(options.settings, options.seed), read_motions(options.motions)
    where = options.where
    if options.kind in ("train", "distil"):
        training = Training(method, motions, options.out, deadline(options.seconds))
        if options.kind == "train":
            return training.train(where)
        return training.distil(where)
    if options.kind == "tried":
        Trying(method, motions, options.out, options.robots).tried(where, options.shard)
    elif options.kind == "sealed":
        Trying(method, motions, options.out, options.robots).sealed(where, options.robot, options.shard)
    elif options.kind == "record":
        OnRobot(method, motions, options.out, options.robots).record(where, options.shard)
    else:
        getattr(OnRobot(method, motions, options.out, options.robots), options.kind)(where)
    return True


def main() -> None:
    """Do one step; exit code 3: not done when the time was over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=DONE)
    parser.add_argument("where", help="folder below --out")
    parser.add_argument("--settings", choices=NAMED, required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--robots", type=Path)
    parser.add_argument("--robot")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--shard", type=int, default=0)
    parser.add_argument("--seconds", type=float)
    options = parser.parse_args()
    try:
        done = do(options)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None
    raise SystemExit(0 if done else GOES_ON)


if __name__ == "__main__":
    main()
