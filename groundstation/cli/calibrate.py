"""`groundstation calibrate`: lenses, mountings and delays, measured; each of its commands in a module of its own."""

import click

from groundstation.cli.calibrate_camera import camera
from groundstation.cli.calibrate_check import check
from groundstation.cli.calibrate_delay import delay
from groundstation.cli.calibrate_extrinsics import extrinsics
from groundstation.cli.calibrate_team import team


@click.group(
    epilog="\b\nExamples:\n"
    "  groundstation calibrate camera http://192.168.1.50:8080/video.mjpg -o my_lab/cameras/ceiling.yaml --force\n"
    "  groundstation calibrate check lab.yaml\n\n"
    'The order of work for a new lab: "Calibrate lenses, mountings and delays" in docs/how-to.'
)
def calibrate() -> None:
    """Measure lenses, mountings and delays for a field file."""


for command in (camera, extrinsics, delay, team, check):
    calibrate.add_command(command)
