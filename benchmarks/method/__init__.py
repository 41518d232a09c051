"""The paper's whole method in one run, beside its controls: experts by cluster, rounds on sealed robots, a transformer.

    python -m benchmarks.study prepare G1_MOVES ASAP CMU_BVH --texts HUMANML3D --out motions
    python -m benchmarks.method run --motions motions --out run --gpus 2 --minutes 9
    python -m benchmarks.study.robots run/base --motions motions --out robots
    python -m benchmarks.method run --motions motions --robots robots --out run --gpus 2 --minutes 9
    python -m benchmarks.method table run --motions motions --robots robots --out method.md
    python -m benchmarks.method run --settings ppo --motions motions --out ppo --gpus 2 --minutes 9
    python -m benchmarks.method beside run ppo --motions motions --out learners.md

From a base policy an expert of each cluster is trained. On each robot, twice: the experts record motions of their own
clusters; the declared model is corrected by a delta action of each cluster (as in the paper), by the diagnosis, or by
both; the experts train on in it. Then a transformer is distilled from them. The controls have equal control steps.

The first `run` does what needs no robot. Each may be ended at any time, and the same command goes on; `study.json` in
the run's folder holds it to its settings, motions and robots.
"""
