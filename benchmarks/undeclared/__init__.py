"""Sealed benchmark of the diagnosis: robots with effects from a seeded lottery, diagnosed blind, scored, and tabulated.

    python -m benchmarks.undeclared --help

- `robots`, `excite`: what is declared of each robot, and the motions it makes;
- `bumblebee.stand_in.undeclared`: the robots as they are, at 1 ms with semi-implicit Euler and effects of their own; it
  has nothing of the diagnosis or of the simulator's effects;
- `resume`, `restarts`, `detectable`, `lottery`: how small an effect can be seen, which cases the suite holds;
- `case`, `judge`, `rivals/`: one case from draw to score, ours beside the other methods;
- `stats`, `table`: intervals and the table.
"""
