"""The policy that needs an IMU and encoders alone; README.md is its card."""
