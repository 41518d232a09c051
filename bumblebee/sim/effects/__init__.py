"""Effects that a model may lack: the catalogue, `effects.yaml`, native MJCF, and what acts beside MuJoCo at run time.

Values are absolute (N m, kg, s, rad ...), so that the effects applied to the declared model *are* the corrected
model; `motor_strength`, `kp` and `kd` alone are factors on the declared gains. The engines that run with them are
`cpu_engine` and `warp_engine`; `sim.engine_choice` chooses.
"""

from bumblebee.effects import native
from bumblebee.effects.catalogue import CATALOGUE, Effect, is_native, single
from bumblebee.effects.kind import Kind
from bumblebee.effects.native import SUFFIX, is_hidden, physical_inertia, sloped, spread_inertia
from bumblebee.effects.setpoints import NO_SPEED_LIMIT, SETPOINTS, advance
from bumblebee.effects.terms import QUOTED, TABLE, Term, read_term
from bumblebee.sim.effects.file import effects_yaml, read_effects, write_effects
from bumblebee.sim.effects.forces import StepHooks
from bumblebee.sim.effects.hooks import RuntimeHooks, hook_joints, runtime_hooks
from bumblebee.sim.effects.memory import Memory, bent, history_length
from bumblebee.sim.effects.spec import add_to_spec, in_order
from bumblebee.sim.effects.states import State, states_of

__all__ = [
    "CATALOGUE",
    "NO_SPEED_LIMIT",
    "QUOTED",
    "SETPOINTS",
    "SUFFIX",
    "TABLE",
    "Effect",
    "Kind",
    "Memory",
    "RuntimeHooks",
    "State",
    "StepHooks",
    "Term",
    "add_to_spec",
    "advance",
    "bent",
    "effects_yaml",
    "history_length",
    "hook_joints",
    "in_order",
    "is_hidden",
    "is_native",
    "native",
    "physical_inertia",
    "read_effects",
    "read_term",
    "runtime_hooks",
    "single",
    "sloped",
    "spread_inertia",
    "states_of",
    "write_effects",
]
