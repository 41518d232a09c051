"""`python -m benchmarks.wire latency|rules|soak|success|loop`: tables for docs/deploy.md and docs/decisions/wire.md."""

import argparse
from pathlib import Path

from benchmarks.wire import latency, loop, real_soak, rules, soak, success


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.wire")
    parser.add_argument("what", choices=("latency", "rules", "soak", "success", "loop"))
    parser.add_argument("--wire", choices=("sim", "lcm"), default="lcm", help="of latency, and of soak in real time")
    parser.add_argument("--minutes", type=float, default=2.0, help="of the clip of latency; of soak, in its own time")
    parser.add_argument("--real-time", action="store_true", help="soak with processes that are stopped and killed")
    parser.add_argument("--motions", nargs="*", default=[], help="of success and loop; all without")
    parser.add_argument("--most", type=int, default=36, help="motions of success, evenly of all")
    parser.add_argument("--sealed", nargs="*", type=Path, help="sealed robots of success; the declared one without")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/wire"), help="datasets of latency and loop, tables")
    options = parser.parse_args()
    runs = {"latency": latency.run, "rules": rules.run, "success": success.run, "loop": loop.run}
    runs["soak"] = real_soak.run if options.real_time else soak.run
    runs[options.what](options)


if __name__ == "__main__":
    main()
