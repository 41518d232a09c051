"""Parameters wrong on all joints at once: what every joint of a real robot has, fitted together.

A robot with friction and latency on every joint is found one effect at a time only by a long way round: each effect
alone explains a twentieth, and what stands for the others' share has a strange name. Where residuals are large still
after two effects (after one, where they are hundreds of times the noise), and the last explained little or they are
very large, the usual ones of all joints are fitted together from the declared values on, or from those found. The
drives' strengths are free only where the data need them: a servo's strength, its joint's inertia and its friction go by
one common factor nearly as a torque drive's do (`declared_scale`). Of a small robot a load on one link is asked first,
by itself and then beside them (`link_load`): it weakens all drives as far as these can tell. Where residuals stay large
masses and centres of mass of all links follow. What is not sure is taken out again, and the rest has to pay on windows
that took no part; these and the fitted ones are then whitened anew, and the search goes on from there. It begins so in
the place of gains far from the declared ones (`gain_grid`), and on a robot far from the data where they leave next to
nothing and no effect that was tried by itself comes near. A large robot's rotors and friction begin at likely sizes
where the model, made from a drawing, has none (`begun`); masses of its links come in by slopes (`loads`), and a joint
that hardly moves is held by dry friction, not by damping (`held_joints`). Where torques are logged and the base is
fixed none of this is asked: a regression says where to begin (`standard_parameters`).
"""

from bumblebee.diagnosis.selection.proposals.all_joints.fit import fit_all_joints, is_told_torques
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
    "fit_all_joints",
    "is_nearer",
    "is_told_torques",
    "start_far_off",
    "start_with_all_joints",
    "whitened_anew",
]
