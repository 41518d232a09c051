"""The 3D picture: a MuJoCo model in viser, whose camera follows the first robot or stands still."""

from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import numpy as np
import viser
from mjviser import ViserMujocoScene

from bumblebee.report.replays.replay import Drawn
from bumblebee.view.drawing import OTHERS, drawing

_CAMERA = np.array([1.9, -1.9, 0.7])  # m from what it looks at
_FIELD = np.radians(45.0)  # vertical field of view


class Picture:
    """Robots that are drawn now; another set of robots makes a new scene.

    Args:
        server: where the page is.
        meshes: folder of the G1's meshes; None for primitives.
        make: spec of another robot than the G1.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        meshes: Path | None = None,
        make: Callable[[], mujoco.MjSpec] | None = None,
    ) -> None:
        self.server, self._meshes, self._make = server, meshes, make
        self._robots: Sequence[Drawn] = ()
        self._scene: ViserMujocoScene | None = None
        self._data: mujoco.MjData | None = None
        self._follow, self._others = True, True
        server.initial_camera.position, server.initial_camera.look_at = _CAMERA, np.zeros(3)
        server.initial_camera.fov = float(_FIELD)

    def choose(self, robots: Sequence[Drawn]) -> None:
        """Draw these robots from now on."""
        if tuple(robots) == tuple(self._robots):
            return
        self._robots = robots
        self.server.scene.reset()
        model = drawing(robots, self._meshes, self._make)
        self._data = mujoco.MjData(model)
        self._scene = ViserMujocoScene(self.server, model, 1)
        self._scene.camera_tracking_enabled = self._follow
        self.show_others(self._others)

    def show(self, qpos: np.ndarray) -> None:
        """Draw one state (nq,) of all robots."""
        assert self._scene is not None and self._data is not None
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._scene.mj_model, self._data)
        self._scene.update_from_mjdata(self._data)

    def follow(self, wanted: bool) -> None:
        """Let the camera go with the first robot, or stand where it is."""
        self._follow = wanted
        if self._scene is None or self._data is None or wanted == self._scene.camera_tracking_enabled:
            return
        self._scene.camera_tracking_enabled = wanted
        place = self._data.xpos[self._scene._tracked_body_id or 0].copy()
        for client in self.server.get_clients().values():
            shift = -place if wanted else place
            client.camera.position = client.camera.position + shift
            client.camera.look_at = client.camera.look_at + shift

    def show_others(self, wanted: bool) -> None:
        """Draw all robots, or the first alone."""
        self._others = wanted
        if self._scene is not None:
            self._scene.geom_groups_visible[OTHERS] = wanted
            self._scene._sync_visibilities()
