"""What the console is handed at its start."""

import msgspec


class ConsoleSection(msgspec.Struct, frozen=True):
    """The resolved field as JSON, the run folder, the tracker's first epoch, and whether ground truth is to be had."""

    field: msgspec.Raw
    run_dir: str = ""
    epoch: int = 0
    truth: bool = False


class _Console(msgspec.Struct, frozen=True):
    port: int = 8765


class _Field(msgspec.Struct, frozen=True):
    console: _Console = _Console()


def port_of(field: bytes) -> int:
    """Return the port that the field asks for."""
    return msgspec.json.decode(field, type=_Field).console.port
