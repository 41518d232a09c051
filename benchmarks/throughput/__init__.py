"""How much of the simulator's speed is left for learning; `python -m benchmarks.throughput --help`."""
