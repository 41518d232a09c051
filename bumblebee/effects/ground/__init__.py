"""What the robot stands on and touches."""
