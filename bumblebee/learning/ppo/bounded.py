"""rsl_rl's PPO as we train with it: bounds on the learning rate, and a choice of two updates."""

import sys
from typing import Any

from rsl_rl.algorithms import PPO

from bumblebee.learning.ppo.update import DeviceUpdate, cannot

_OPTIONS = ("capturable", "fused", "foreach")  # of Adam; they follow from the update and the device, not from a file


class BoundedPpo(PPO):
    """rsl_rl's PPO with bounds on the adaptive learning rate, which are constants there (1e-5 and 1e-2).

    Args:
        learning_rate_range: the bounds.
        captured: update by `learning.ppo.update` instead of rsl_rl's own method; the same mathematics.
    """

    _device_update: DeviceUpdate | None = None

    def __init__(
        self, *args: Any, learning_rate_range: tuple[float, float], captured: bool = False, **kwargs: Any
    ) -> None:
        self._bounds = learning_rate_range
        super().__init__(*args, **kwargs)
        if captured and (lacking := cannot(self)) is not None:
            print(f"update: rsl_rl's own, since the captured one lacks {lacking}", file=sys.stderr, flush=True)
        elif captured:
            self._device_update = DeviceUpdate(self, learning_rate_range)

    @property
    def learning_rate(self) -> float:
        """The rate of the next gradient step."""
        return self._learning_rate

    @learning_rate.setter
    def learning_rate(self, value: float) -> None:
        self._learning_rate = min(max(value, self._bounds[0]), self._bounds[1])
        if self._device_update is not None:
            self._device_update.rate.fill_(self._learning_rate)

    def update(self) -> dict[str, float]:
        """All gradient steps of an iteration; the means of the losses."""
        return super().update() if self._device_update is None else self._device_update()

    def save(self) -> dict[str, Any]:
        """The networks and the optimiser, of one form whichever update is used."""
        saved = super().save()
        if self._device_update is not None:
            rate = {"lr": self.learning_rate}
            saved["optimizer_state_dict"] = _with_groups(saved["optimizer_state_dict"], rate)
        return saved

    def load(self, loaded_dict: dict[str, Any], load_cfg: dict[str, Any] | None, strict: bool) -> bool:
        """Go on from what `save` gave, whichever update was used then."""
        group = self.optimizer.param_groups[0]
        own = {name: group[name] for name in _OPTIONS if name in group}
        loaded = loaded_dict | {"optimizer_state_dict": _with_groups(loaded_dict["optimizer_state_dict"], own)}
        whole = super().load(loaded, load_cfg, strict)
        if self._device_update is not None:
            self._device_update.attach_rate()
        return whole


def _with_groups(saved: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """The state of an optimiser with these entries of its groups of parameters."""
    return saved | {"param_groups": [group | changes for group in saved["param_groups"]]}
