"""Errors that simprep raises on purpose. Messages say what was given and what is valid."""

from collections.abc import Iterable


class SimprepError(Exception):
    """Base of every error raised on purpose; the command line prints it as one line and exits with code 2."""


class MotionFileError(SimprepError):
    """A motion file is missing, malformed or of the wrong kind.

    Args:
        path: the file.
        message: what was found and what is valid.
        line: line number in the file, counted from 1, where known.
    """

    def __init__(self, path: object, message: str, line: int | None = None) -> None:
        self.path, self.line = path, line
        where = f"{path}, line {line}" if line is not None else f"{path}"
        super().__init__(f"{where}: {message}")


class RobotFileError(SimprepError):
    """A robot's model or its description is missing, malformed or no floating-base humanoid.

    Args:
        path: the file.
        message: what was found and what is valid.
    """

    def __init__(self, path: object, message: str) -> None:
        self.path = path
        super().__init__(f"{path}: {message}")


class MotionError(SimprepError):
    """Motion data contradicts itself or the model (shape, NaN, frame range, other model)."""


class UnknownNameError(SimprepError):
    """A name is not among the valid choices, which the message lists."""

    def __init__(self, kind: str, name: str, choices: Iterable[str]) -> None:
        self.choices = tuple(choices)
        super().__init__(f"unknown {kind} {name!r}; valid: {', '.join(self.choices)}")


class SettingError(SimprepError):
    """A setting is outside its valid range."""


class MissingExtraError(SimprepError):
    """An optional dependency is needed; the message says how to install it."""

    def __init__(self, feature: str, extra: str) -> None:
        super().__init__(f"{feature} needs an optional dependency: pip install 'simprep[{extra}]'")
