"""The robot as it is: laws of effects that nobody declared, and their simulation at 1 ms.

- `declared`: what is declared of a robot, and the figures that laws start from;
- `law`: where an effect can act; `bodies`, `drives`, `friction`, `gears`, `signals`: the catalogue; `outside`: others;
- `kinds`: how a size becomes a law; `ringing`: how soft a shaft may be; `faults`: which sizes are still a robot;
- `model`, `memory`, `simulation`: many robots side by side, of which some move.

What the diagnosis finds must not share code with what it looks for: nothing here is imported from `bumblebee.diagnosis`
or `bumblebee.sim`; a test holds it to that.
"""
