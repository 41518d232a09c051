"""From a motion of a person to one of the robot: inverse kinematics over the whole trajectory."""
