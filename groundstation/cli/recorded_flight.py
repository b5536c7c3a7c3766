"""The shared part of commands that calibrate by a recorded flight: its name, its field, the tracker's inputs."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

if TYPE_CHECKING:
    from groundstation.calibration.flown import Flown
    from groundstation.settings.schema import Field


class RecordedFlight(NamedTuple):
    """A recording's name, the flown field, and the tracker's inputs."""

    name: str
    field: "Field"
    flown: "Flown"


def recorded_flight(recording: tuple[Path, ...]) -> RecordedFlight:
    """Return the flight of a recording, and tell its damage; raises UsageError if it holds none that can be read."""
    from groundstation.cli.kernels import use_flying_kernels
    from groundstation.recording.reader import RecordingError
    from groundstation.replay.source import open_source
    from groundstation.settings.recorded import recorded_field

    try:
        source = open_source(recording)
        field = recorded_field(source.field)
        use_flying_kernels()
        from groundstation.calibration.recorded_likelihood import flown_of

        flown = flown_of(source)
    except RecordingError as error:
        raise click.UsageError(str(error)) from error
    for doubt in flown.doubts:
        click.echo(f"note: {doubt}", err=True)
    return RecordedFlight(source.name, field, flown)
