"""The command line of the motions; see the package."""

import argparse
from pathlib import Path

import benchmarks.study
from benchmarks.study.motions import Motions, prepare
from bumblebee.errors import EXIT_BAD_INPUT, BadInput


def run_prepare(options: argparse.Namespace) -> None:
    """Read the sources and write the motions."""
    motions = prepare(options.sources, options.out, options.texts, options.clusters)
    print(_counted(motions))
    print((options.out / "clusters.txt").read_text(), end="")


def _counted(motions: Motions) -> str:
    table = motions.labels.groupby("split").agg(
        pieces=("name", "size"), motions=("motion", "nunique"), seconds=("seconds", "sum")
    )
    return table.to_string()


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.study",
        description=benchmarks.study.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True)
    own = commands.add_parser("prepare", help="read, hold out, filter and cluster the motions")
    own.add_argument("sources", nargs="+", type=Path)
    own.add_argument("--texts", type=Path, help="HumanML3D's folder")
    own.add_argument("--clusters", type=int, default=0, help="0: as many as the elbow says")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run_prepare)
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> None:
    """Run a command; bad input is one line and status 2."""
    options = parse(arguments)
    try:
        options.work(options)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
