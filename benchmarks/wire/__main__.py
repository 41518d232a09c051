"""`python -m benchmarks.wire latency|rules|soak|success|loop`: tables for docs/deploy.md and docs/decisions/wire.md."""

import argparse
from pathlib import Path

from benchmarks.wire import latency, loop, rules, soak, success


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wire")
    parser.add_argument("what", choices=("latency", "rules", "soak", "success", "loop"))
    parser.add_argument("--wire", choices=("sim", "lcm"), default="lcm", help="of latency")
    parser.add_argument("--minutes", type=float, default=2.0, help="of the clip of latency; of soak, in its own time")
    parser.add_argument("--motions", nargs="*", default=[], help="of success and loop; all without")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/wire"), help="datasets of latency and loop")
    options = parser.parse_args()
    run = {"latency": latency.run, "rules": rules.run, "soak": soak.run, "success": success.run, "loop": loop.run}
    run[options.what](options)


if __name__ == "__main__":
    main()
