"""What a drive does with its gains and its torque."""
