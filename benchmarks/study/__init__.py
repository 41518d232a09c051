"""The study of the paper's claims: experts, controls at equal steps, and tables with intervals.

    python -m benchmarks.study prepare G1_MOVES ASAP_G1 CMU_BVH --texts HUMANML3D --out study/motions
    python -m benchmarks.study run experts --motions study/motions --out study/experts --gpus 2 --minutes 9
    python -m benchmarks.study table experts study/experts --motions study/motions --out experts.md

`prepare` needs the motions' sources and a text encoder, and writes plain files; everything after it runs where only
torch, MuJoCo and this library are. Training can be killed or ended by `--minutes`: the same command goes on.
"""
