"""The shared part of commands that calibrate by a recorded flight: its name, its field, and what was taken in."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

if TYPE_CHECKING:
    from groundstation.calibration.flown import Flown
    from groundstation.settings.schema import Field


class RecordedFlight(NamedTuple):
    """A recording's name, the field file that was flown, and what the tracker took in."""

    name: str
    field: "Field"
    flown: "Flown"


def recorded_flight(recording: tuple[Path, ...]) -> RecordedFlight:
    """Return the flight of a recording; raises UsageError where none can be read of it."""
    from groundstation.cli.kernels import use_flying_kernels
    from groundstation.recording.reader import RecordingError
    from groundstation.replay.source import open_source
    from groundstation.settings.recorded import recorded_field

    try:
        source = open_source(recording)
        field = recorded_field(source.field)
        use_flying_kernels()
        from groundstation.calibration.recorded_likelihood import flown_of

        return RecordedFlight(source.name, field, flown_of(source))
    except RecordingError as error:
        raise click.UsageError(str(error)) from error
