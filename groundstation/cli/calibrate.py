"""`groundstation calibrate`: lenses, mountings and delays, measured; each of its commands in a module of its own."""

import click

from groundstation.cli.calibrate_camera import camera
from groundstation.cli.calibrate_extrinsics import extrinsics


@click.group(epilog="Example: groundstation calibrate camera http://192.168.1.50:8080/video.mjpg --name ceiling")
def calibrate() -> None:
    """Measure what the field file and its calibrations say of cameras and sensors."""


calibrate.add_command(camera)
calibrate.add_command(extrinsics)
