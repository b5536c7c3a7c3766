"""Words for a wrong marker, lens or fixed camera, the same before a take-off and in flight. Pure."""

# For a fixed camera's mounting: words for more, and for less.
_HANGS = {
    "z": ("hangs {size} higher than the field says", "hangs {size} lower than the field says"),
    "aside": ("hangs {size} to the side of where the field puts it",) * 2,
    "yaw": (
        "is turned by {size} counter-clockwise (seen from above), compared with the field",
        "is turned by {size} clockwise (seen from above), compared with the field",
    ),
    "tilted": ("is tilted by {size} compared with the field",) * 2,
}
_LENS = "calibrate the lens of {who} (groundstation calibrate camera)"


def marker_is(who: str, share: float, std: float) -> str:
    """Return words for the share by which a marker ("": all) is larger or smaller than the field says."""
    whose = f"{who}'s marker is" if who else "all markers are"
    return f"{whose} {_percent(share, std)} {'larger' if share > 0.0 else 'smaller'} than the field says"


def measured_by(setting: str = "its size in the field", told: str = "") -> str:
    """Return the remedy for a marker of another size; told: the measured size, in brackets."""
    return f"measure it with a ruler{told}: print it without scaling, or set {setting}"


def lens_is(camera: str, share: float, std: float) -> str:
    """Return words for the share by which a camera's focal length is longer or shorter than its calibration says."""
    longer = "longer" if share > 0.0 else "shorter"
    return f"{camera} has a focal length {_percent(share, std)} {longer} than calibrated"


def calibrated_lens(who: str) -> str:
    """Return the remedy for a lens that differs from its calibration."""
    return _LENS.format(who=who)


def fixed_camera(who: str) -> str:
    """Return the name of a camera that is fixed in the world."""
    return f"the camera {who}"


def hangs(who: str, what: str, more: bool, size: str) -> str:
    """Return words for the error of a fixed camera's mounting; what: z, aside, yaw, tilted; more: its sign."""
    return f"{fixed_camera(who)} {_HANGS[what][not more].format(size=size)}"


def _percent(share: float, std: float) -> str:
    return f"{abs(100.0 * share):.1f} +- {100.0 * std:.1f} %"
