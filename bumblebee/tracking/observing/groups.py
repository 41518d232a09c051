"""One group of observations: its terms, its sensor noise, its history."""

from collections.abc import Callable
from functools import partial

import torch
from torch import Tensor

from bumblebee.sim.engine import RobotState
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.observing.history import History
from bumblebee.tracking.observing.noise import noise_levels
from bumblebee.tracking.observing.sensor_errors import SensorErrors
from bumblebee.tracking.observing.terms import Part, expanded, parts, see
from bumblebee.tracking.rows import Rows
from bumblebee.tracking.sampling.library import ReferenceFrame

Look = Callable[[RobotState, ReferenceFrame, Tensor], Tensor]


class Group:
    """Observation of B robots for one network; on a GPU in tensors that stay in place, since looks are recorded there.

    Args:
        config: its terms and history.
        sizes: (B, J, A) worlds, joints, reference frames further ahead.
        noise: factor on the sensor noise; with 0 the group is exact.
        device: where the robots' states are.
        compiled: whether torch compiles the terms.
        errors: of the sensors, which stay through an episode, if any; a group whose own `noise` is 0 is exact.
    """

    def __init__(
        self,
        config: ObservationConfig,
        sizes: tuple[int, int, int],
        noise: float,
        device: torch.device,
        compiled: bool = False,
        errors: SensorErrors | None = None,
    ) -> None:
        worlds, joints, ahead = sizes
        self.parts: list[Part] = parts(config.terms, joints, ahead)
        """Parts of one control step, those that are seen over the history."""
        self.parts_now: list[Part] = parts(config.now, joints, ahead)
        """Parts of which the newest step alone is seen."""
        self._look: Look = partial(see, expanded((*config.terms, *config.now)))
        if compiled:
            self._look = torch.compile(self._look, dynamic=False)
        levels = noise * config.noise * noise_levels(self.parts + self.parts_now)
        self._size = sum(size for _, size in self.parts)
        self.levels = levels.to(device) if bool(levels.any()) else None
        """Largest error (D + N,) of each entry of a control step; None: it is exact."""
        self.errors = errors if config.noise else None
        """Errors that stay through an episode; None: there are none."""
        kinds = 1 if self.levels is None and self.errors is None else 2
        kept = kinds if config.history > 1 else 0
        self._worlds, self._stays = worlds, device.type == "cuda"
        self._rings = [History(worlds, self._size, config.history, device) for _ in range(kept)]
        whole = torch.zeros(worlds, config.history * self._size + len(levels) - self._size, device=device)
        self.exact = whole
        """(B, H * D + N) without noise, N of it the newest step's alone."""
        self.noisy = whole if kinds == 1 else whole.clone()
        """(B, H * D + N) as sensors would have it."""

    def draws(self, generator: torch.Generator) -> Tensor | None:
        """Numbers (B, D + N) from -1 to 1 for the next look's noise; None for a group that is exact."""
        if self.levels is None:
            return None
        drawn = torch.empty(self._worlds, len(self.levels), device=self.levels.device)
        return drawn.uniform_(-1, 1, generator=generator)

    def look(
        self,
        state: RobotState,
        ref: ReferenceFrame,
        action: Tensor,
        fresh: Rows,
        generator: torch.Generator,
        begun: Callable[[], Tensor | None] | None = None,
    ) -> None:
        """Take in a control step of all worlds; those `fresh` have begun an episode with it.

        `begun` gives what `draws` did if it was called before.
        """
        exact = self._look(state, ref, action)
        drawn = self.draws(generator) if begun is None else begun()
        rows = [exact]
        read = exact
        if self.errors is not None:
            read = self._look(self.errors.read(state, self.errors.now), ref, action)
        if self.levels is not None and drawn is not None:
            read = torch.addcmul(read, self.levels, drawn)
        if read is not exact:
            rows.append(read)
        if self._rings:
            for ring, row in zip(self._rings, rows, strict=True):
                ring.add(row[:, : self._size], fresh)
            pairs = zip(self._rings, rows, strict=True)
            rows = [torch.cat((ring.stacked(), row[:, self._size :]), dim=-1) for ring, row in pairs]
        self.show(rows[0], rows[-1])

    def show(self, exact: Tensor, noisy: Tensor) -> None:
        """Let these be what is seen now, (B, H * D + N) each; on a CPU they are taken as they are."""
        if not self._stays:
            self.exact, self.noisy = exact, noisy
            return
        self.exact.copy_(exact)
        if self.noisy is not self.exact:
            self.noisy.copy_(noisy)

    def kept(self) -> dict[str, Tensor]:
        """All that the next look depends on."""
        kept: dict[str, Tensor] = {}
        for index, ring in enumerate(self._rings):
            kept |= {f"ring{index}": ring.ring, f"oldest{index}": ring.oldest}
        return kept
