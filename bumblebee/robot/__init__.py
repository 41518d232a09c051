"""The robot: the Unitree G1 as a table of facts and a MuJoCo model built from it."""
