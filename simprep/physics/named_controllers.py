"""Tracking controllers by their names."""

from functools import partial

from simprep.errors import SettingError, UnknownNameError
from simprep.physics.balance import BalanceController
from simprep.physics.controller import ControllerFactory, PdController
from simprep.physics.mpc import MpcController
from simprep.physics.mpc_settings import MpcSettings

CONTROLLERS = ("pd", "balance", "mpc")
"""Controllers known by name."""


def controller_factory(controller: str | ControllerFactory, mpc: MpcSettings) -> ControllerFactory:
    """What makes a controller for a task.

    Args:
        controller: a name of `CONTROLLERS`, or a class or function that takes a `ControlTask`.
        mpc: settings of `mpc`.

    Raises:
        UnknownNameError: no such controller.
        SettingError: neither a name nor callable.
    """
    if controller == "pd":
        return PdController
    if controller == "balance":
        return BalanceController
    if controller == "mpc":
        return partial(MpcController, settings=mpc)
    if isinstance(controller, str):
        raise UnknownNameError("controller", controller, CONTROLLERS)
    if not callable(controller):
        raise SettingError(
            f"controller {controller!r}; valid: {', '.join(CONTROLLERS)}, or a class or function that takes a ControlTask"
        )
    return controller
