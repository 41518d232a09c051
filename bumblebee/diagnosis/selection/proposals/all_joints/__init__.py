"""Parameters wrong on all joints at once: what every joint of a real robot has, fitted together.

A robot with friction and latency on every joint is found one effect at a time only by a long way round: each effect
alone explains a twentieth, and what stands for the others' share has a strange name. Where residuals are large still
after two effects (after one, where they are hundreds of times the noise), and the last explained little or they are
very large, all joints are fitted together; on a robot far from the data before anything else.

A regression on inverse dynamics says where to begin (`standard_parameters`). Where the base is free the ground pushes
back, and whatever torque it can make is unknown (`sensitivities.ground`): legs that share the weight say little, and
the simulator says the rest. There masses of links come in by slopes (`loads`), and a joint that hardly moves is held by
dry friction, not by damping (`held_joints`). What is not sure is taken out again, and the rest has to pay on windows
that took no part; these and the fitted ones are then whitened anew, and the search goes on from there.
"""

from bumblebee.diagnosis.selection.proposals.all_joints.fit import is_fixed, not_simulated
from bumblebee.diagnosis.selection.proposals.all_joints.standard_parameters import standard_parameters
from bumblebee.diagnosis.selection.proposals.all_joints.start import (
    all_joints_of,
    begun_with,
    is_nearer,
    start_far_off,
    start_with_all_joints,
    whitened_anew,
)

__all__ = [
    "all_joints_of",
    "begun_with",
    "is_fixed",
    "is_nearer",
    "not_simulated",
    "standard_parameters",
    "start_far_off",
    "start_with_all_joints",
    "whitened_anew",
]
