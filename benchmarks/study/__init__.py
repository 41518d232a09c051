"""Motions, sealed robots and tables that several benchmarks share; left of the first study of the paper's claims.

    python -m benchmarks.study prepare G1_MOVES ASAP_SMPL CMU_BVH --texts HUMANML3D --out motions
    python -m benchmarks.study.robots run/base --motions motions --out robots

`prepare` needs the motions' sources and a text encoder, and writes plain files; everything after it runs where only
torch, MuJoCo and this library are. The study itself is of commit 21719608; since then `benchmarks.method` runs the
paper's method and its controls.
"""
