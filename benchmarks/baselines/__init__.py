"""Ways of whole-body control on the same robot, motions and budget; `python -m benchmarks.baselines --help`."""
