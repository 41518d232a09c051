"""Simulation of a robot with given effects: the declared model varied, on windows of the logs."""

from bumblebee.diagnosis.simulation.batches import own_batch, with_step
from bumblebee.diagnosis.simulation.cache import Changes, Recall
from bumblebee.diagnosis.simulation.chunk import Starts
from bumblebee.diagnosis.simulation.collision_culling import out_of_reach, without
from bumblebee.diagnosis.simulation.condition_plants import make_plants
from bumblebee.diagnosis.simulation.conditions import Condition, in_words
from bumblebee.diagnosis.simulation.declared import declared_values, spot
from bumblebee.diagnosis.simulation.failures import LEFT_OUT, NOT_TRIED, REFUSALS, effects_in_words
from bumblebee.diagnosis.simulation.inputs import inputs_of
from bumblebee.diagnosis.simulation.joint_path import joint_path
from bumblebee.diagnosis.simulation.plant import Plant, make_plant, plant_by, refuse_unlogged
from bumblebee.diagnosis.simulation.readings import (
    Layout,
    difference,
    layout_of,
    measured_readings,
    simulated_readings,
    smallest_moves,
)
from bumblebee.diagnosis.simulation.servo_damping import damping_rates
from bumblebee.diagnosis.simulation.simulate import at_ticks, residuals
from bumblebee.diagnosis.simulation.starts.activations import activations
from bumblebee.diagnosis.simulation.starts.actuator_history import (
    at_starts,
    bent_before,
    lagged,
    plant_servos,
    read_at,
    remember,
    state_before,
    window_servos,
    yielded,
)
from bumblebee.diagnosis.simulation.starts.base_height import heights_of
from bumblebee.diagnosis.simulation.starts.setpoints import begin_setpoints, setpoints_of
from bumblebee.diagnosis.simulation.stop import OutOfTime, Stop, ending
from bumblebee.diagnosis.simulation.units import (
    KINDS,
    joint_units,
    members,
    mixed_notes,
    motion_error,
    named,
    of_joint,
    pick,
    position_rows,
    rows,
    unit_on,
)
from bumblebee.diagnosis.simulation.variation import Variation, vary, vary_or_refuse
from bumblebee.diagnosis.simulation.windows import Windows, choose_starts, command_inputs, cut, select, start_state

__all__ = [
    "KINDS",
    "LEFT_OUT",
    "NOT_TRIED",
    "REFUSALS",
    "Changes",
    "Condition",
    "Layout",
    "OutOfTime",
    "Plant",
    "Recall",
    "Starts",
    "Stop",
    "Variation",
    "Windows",
    "activations",
    "at_starts",
    "at_ticks",
    "begin_setpoints",
    "bent_before",
    "choose_starts",
    "command_inputs",
    "cut",
    "damping_rates",
    "declared_values",
    "difference",
    "effects_in_words",
    "ending",
    "heights_of",
    "in_words",
    "inputs_of",
    "joint_path",
    "joint_units",
    "lagged",
    "layout_of",
    "make_plant",
    "make_plants",
    "measured_readings",
    "members",
    "mixed_notes",
    "motion_error",
    "named",
    "of_joint",
    "out_of_reach",
    "own_batch",
    "pick",
    "plant_by",
    "plant_servos",
    "position_rows",
    "read_at",
    "refuse_unlogged",
    "remember",
    "residuals",
    "rows",
    "select",
    "setpoints_of",
    "simulated_readings",
    "smallest_moves",
    "spot",
    "start_state",
    "state_before",
    "unit_on",
    "vary",
    "vary_or_refuse",
    "window_servos",
    "with_step",
    "without",
    "yielded",
]
