"""Requires optional libraries: the error for a missing one names the command that installs it."""

from importlib.util import find_spec

from groundstation.errors import OperatorMistake


def _require(module: str, library: str, extra: str) -> None:
    if find_spec(module) is None:
        raise OperatorMistake(f'{library} is not installed: pip install "skein-groundstation[{extra}]"')


def require_rerun() -> None:
    """Raise OperatorMistake, with the remedy, when the extra [rerun] is not installed."""
    _require("rerun", "Rerun", "rerun")


def require_foxglove() -> None:
    """Raise OperatorMistake, with the remedy, when the extra [foxglove] is not installed."""
    _require("foxglove", "The Foxglove SDK", "foxglove")


def require_parquet() -> None:
    """Raise OperatorMistake, with the remedy, when the extra [parquet] is not installed."""
    _require("pyarrow", "pyarrow", "parquet")


def require_ros2() -> None:
    """Raise OperatorMistake, with the remedy, when the extra [ros2] is not installed."""
    _require("rosbags", "rosbags", "ros2")
