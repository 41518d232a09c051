"""Paths of windows through their steps, with hooks beside MuJoCo; one that was simulated before is not simulated again.

Nuisances, residuals, intervals and the report ask for the same models on the same windows, each for readings of its
own. A path is known again by all that it follows from, to the bit: model, states, commands, hooks and their memory.
"""

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from operator import attrgetter
from typing import Any
from weakref import WeakKeyDictionary

import mujoco
import numpy as np
from mujoco.batch import MODEL_FIELDS, Batch

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.starts.actuator_history import remember
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows
from bumblebee.sim.effects import Memory, RuntimeHooks, StepHooks, hook_joints
from bumblebee.sim.servo import servos_each, servos_of

_KEPT_BYTES = 64e6

Rolled = tuple[np.ndarray, np.ndarray, np.ndarray]
"""States (n, K, nq) and (n, K, nv) after every step, and which of the n failed (n,)."""


@dataclass(eq=False)
class _Paths:
    """The latest paths of a plant by what they follow from; the oldest go first."""

    kept: OrderedDict[bytes, Rolled] = field(default_factory=OrderedDict)
    size: int = 0
    """Bytes."""

    def add(self, key: bytes, path: Rolled) -> None:
        """Keep a path as long as there is room; whoever asked for it must not write to it."""
        for values in path:
            values.flags.writeable = False
        self.kept[key], self.size = path, self.size + _bytes(path)
        while self.size > _KEPT_BYTES:
            self.size -= _bytes(self.kept.popitem(last=False)[1])


_known: WeakKeyDictionary[Plant, _Paths] = WeakKeyDictionary()
_contents: WeakKeyDictionary[Plant, Callable[[mujoco.MjModel], tuple[Any, ...]]] = WeakKeyDictionary()


def roll(
    batch: Batch, plant: Plant, windows: Windows, chosen: Sequence[Variation], control: np.ndarray, once: bool = False
) -> Rolled:
    """Step a batch of all windows under each of the `chosen` through the controls (n, K, nu).

    What is asked for but `once` is not kept.
    """
    running = _running(batch, plant, windows, chosen[0])
    size, every = len(windows), np.arange(len(control))
    if once:
        return _stepped(batch, running, control, every)
    paths = _known.setdefault(plant, _Paths())
    parts = [slice(k * size, (k + 1) * size) for k in range(len(chosen))]
    given = [(v, (windows.condition, batch.state[part], control[part])) for v, part in zip(chosen, parts, strict=True)]
    keys = [_key(v, v.plant or plant, arrays, running) for v, arrays in given]
    found = {key: paths.kept[key] for key in keys if key in paths.kept}
    new: dict[bytes, slice] = {}
    for key, part in zip(keys, parts, strict=True):
        if key not in found:
            new.setdefault(key, part)
    if new:
        made = _stepped(batch, running, control, np.concatenate([every[part] for part in new.values()]))
        for key, part in zip(new, parts, strict=False):
            q, v, failed = (values[part] for values in made)
            found[key] = (q, v, failed) if len(new) == 1 else (q.copy(), v.copy(), failed)
            paths.add(key, found[key])
    if len(keys) == 1:
        return found[keys[0]]
    q, v, failed = (np.concatenate(values) for values in zip(*(found[key] for key in keys), strict=True))
    return q, v, failed


def _stepped(batch: Batch, running: StepHooks | None, control: np.ndarray, rows: np.ndarray) -> Rolled:
    """Step those of the batch at `rows` (R,); all of it where hooks run beside it."""
    count = control.shape[1]
    if running is None:
        out = batch.rollout(count, control[rows], record=("qpos", "qvel"), ids=rows)
        return out["qpos"], out["qvel"], batch.warning.reshape(batch.nsim, -1).any(axis=1)[rows]
    q, v, ctrl = batch.bind("qpos"), batch.bind("qvel"), batch.bind("ctrl")
    path_q, path_v = np.empty((len(q), count, q.shape[1])), np.empty((len(v), count, v.shape[1]))
    for k in range(count):
        ctrl[:] = control[:, k]
        running.apply()
        batch.step()
        path_q[:, k], path_v[:, k] = q, v
    return path_q, path_v, batch.warning.reshape(batch.nsim, -1).any(axis=1)


def _running(batch: Batch, plant: Plant, windows: Windows, lead: Variation) -> StepHooks | None:
    """Hooks that run beside a batch, with the windows' memory; None where none acts in every step."""
    hooks, copies = lead.hooks, batch.nsim // len(windows)
    if hooks is None:
        return None
    condition = np.tile(windows.condition, copies)
    servos = servos_each([servos_of(model, hook_joints(model)) for model in lead.models], condition)
    if lead.others:
        servos = replace(servos, supply=np.array([p.condition.supply for p in plant.every])[condition, None])
    running = StepHooks(hooks, lead.model, batch, servos)
    step = float(lead.model.opt.timestep)
    running.reset(np.arange(batch.nsim), _repeated(remember(plant, windows, hooks, step), copies))
    return running if hooks.each_step else None


def _repeated(memory: Memory, copies: int) -> Memory:
    """The memory of every window, once for each copy of the windows."""
    values = {f.name: getattr(memory, f.name) for f in fields(memory)}
    more: dict[str, Any] = {k: None if v is None else np.concatenate([v] * copies) for k, v in values.items()}
    return Memory(**more)


def _key(variation: Variation, own: Plant, given: Sequence[np.ndarray], running: StepHooks | None) -> bytes:
    """All that the paths of some windows follow from, as a hash: a model of the plant `own`, hooks, what is `given`."""
    made = hashlib.sha1(repr([values.shape for values in given]).encode(), usedforsecurity=False)
    arrays = [*(values for model in variation.models for values in _content(own)(model)), *given]
    if running is not None and variation.hooks is not None:
        arrays += running.state_dict().values()
        made.update(_words(variation.hooks))
    for values in arrays:
        made.update(np.ascontiguousarray(values).data)
    return made.digest()


def _content(own: Plant) -> Callable[[mujoco.MjModel], tuple[Any, ...]]:
    """Getter of all of a model but its assets (meshes, height fields), which are the plant's own."""
    if own not in _contents:
        names = (name for name in sorted(MODEL_FIELDS) if np.size(attrgetter(name)(own.model)))
        _contents[own] = attrgetter(*names)
    return _contents[own]


def _words(hooks: RuntimeHooks) -> bytes:
    """All that hooks hold."""
    terms = [(column, coefficient, term.text) for column, coefficient, term in hooks.terms]
    arrays = [getattr(hooks, f.name) for f in fields(hooks)]
    whole = b"".join(values.tobytes() for values in arrays if isinstance(values, np.ndarray))
    return repr((terms, hooks.laws, hooks.hysteresis, hooks.rotors)).encode() + whole


def _bytes(path: Rolled) -> int:
    return sum(values.nbytes for values in path)
