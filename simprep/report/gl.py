"""Which GL library can draw off screen here: each is tried in a child process, as a broken one can abort a process.

`import mujoco` itself loads the library named by MUJOCO_GL; this module works whether that happened or not.
"""

import contextlib
import importlib
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from simprep.errors import MissingExtraError, SimprepError

LINUX_BACKENDS = ("egl", "osmesa", "glfw")
PROBE_TIMEOUT_S = 20.0
WISH = "SIMPREP_GL"
"""Environment variable that stands for MUJOCO_GL where the command line has hidden that one from `import mujoco`."""
OFF = ("disable", "disabled", "off", "false", "0")

INSTALL_HINT = (
    "no GL library to draw with; on Debian or Ubuntu: apt install libegl1 libgl1-mesa-dri "
    "(or: apt install libosmesa6), then run again"
)


class NoGlError(SimprepError):
    """Nothing can draw off screen here; the message names the package to install."""


@contextlib.contextmanager
def pictures_or_warning(missing: str, warn: Callable[[str], Any]) -> Iterator[None]:
    """Go on with a warning where a library to draw with is not here; `missing` says what is then left out."""
    try:
        yield
    except (NoGlError, MissingExtraError) as problem:
        warn(f"{missing}: {problem}")


@dataclass(frozen=True)
class Backend:
    """A GL library that draws off screen; its name is `egl`, `osmesa`, `glfw` or `cgl`, as in MUJOCO_GL."""

    name: str

    def context(self, width: int, height: int) -> Any:
        """A GL context of this library, current in this thread, for pictures up to this size [px]."""
        os.environ["MUJOCO_GL"] = self.name  # MuJoCo's C library reads it to find the GL functions
        if self.name in ("egl", "osmesa"):
            os.environ["PYOPENGL_PLATFORM"] = self.name
        context = importlib.import_module(f"mujoco.{self.name}").GLContext(width, height)
        context.make_current()
        return context


@lru_cache(maxsize=1)
def find_backend() -> Backend:
    """The first GL library that draws a picture, tried in a child process each; only MUJOCO_GL, where it is set.

    Raises:
        NoGlError: none works, or MUJOCO_GL turns drawing off.
    """
    wish = os.environ.get(WISH, os.environ.get("MUJOCO_GL", "")).lower().strip()
    if wish in OFF:
        raise NoGlError(f"drawing is turned off by MUJOCO_GL={wish}")
    if wish in ("", "on", "true", "1", "enable", "enabled"):
        candidates: tuple[str, ...] = ("cgl", "glfw") if platform.system() == "Darwin" else LINUX_BACKENDS
    else:
        candidates = (wish,)
    failures = []
    for name in candidates:
        problem = _probe(name)
        if not problem:
            return Backend(name)
        failures.append(f"{name}: {problem}")
    raise NoGlError(f"{INSTALL_HINT} (tried {'; '.join(failures)})")


def _probe(name: str) -> str:
    """What goes wrong when a child process draws with this library; empty if nothing."""
    environment = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"}
    environment["MUJOCO_GL"] = "disable"
    command = [sys.executable, "-m", "simprep.report.gl", name]
    try:
        child = subprocess.run(
            command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PROBE_TIMEOUT_S
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return type(error).__name__
    if child.returncode == 0 and child.stdout.strip().endswith("drawn"):
        return ""
    lines = child.stderr.strip().splitlines()
    return lines[-1][:120] if lines else f"exit code {child.returncode}"


def _draw_one(name: str) -> None:
    import mujoco
    import numpy as np

    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><light pos='0 0 3'/><geom size='1' rgba='1 1 1 1'/></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    gl_context = Backend(name).context(16, 16)
    try:
        picture = Canvas(model, 16, 16, gl_context).draw(data, mujoco.MjvCamera())
        if np.ptp(picture) == 0:
            raise RuntimeError("the picture is empty")
        print("drawn")
    finally:
        gl_context.free()


class Canvas:
    """Draws one model off screen in a current GL context, without shadows and reflections.

    Args:
        model: mujoco.MjModel.
        width: picture width [px].
        height: picture height [px].
        gl_context: a current GL context at least this large; the caller frees it.
    """

    def __init__(self, model: Any, width: int, height: int, gl_context: Any) -> None:
        import mujoco

        self._model, self._width, self._height, self._gl = model, width, height, gl_context
        self._scene = mujoco.MjvScene(model=model, maxgeom=2000)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = False
        self._option = mujoco.MjvOption()
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)

    def draw(self, data: Any, camera: Any) -> Any:
        """The picture of a state, (height, width, 3) uint8.

        Args:
            data: mujoco.MjData after mj_forward (or mj_kinematics).
            camera: mujoco.MjvCamera.
        """
        import mujoco
        import numpy as np

        viewport = mujoco.MjrRect(0, 0, self._width, self._height)
        mujoco.mjv_updateScene(
            self._model, data, self._option, None, camera, mujoco.mjtCatBit.mjCAT_ALL.value, self._scene
        )
        # another canvas of the same GL context may have drawn in between
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        mujoco.mjr_render(viewport, self._scene, self._context)
        picture = np.empty((self._height, self._width, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(picture, None, viewport, self._context)
        return picture[::-1]


if __name__ == "__main__":
    _draw_one(sys.argv[1])
