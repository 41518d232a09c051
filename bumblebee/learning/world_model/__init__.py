"""A learned, differentiable model of the robot, and a policy trained by back-propagation through it."""
