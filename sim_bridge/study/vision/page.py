"""The bench's figures as tables to read and as plots."""

from pathlib import Path
from typing import Any

_COLUMNS = (
    ("followed", "followed %", 100.0, ".0f"),
    ("acquired", "acquired %", 100.0, ".0f"),
    ("searched", "searched %", 100.0, ".0f"),
    ("identified", "identity %", 100.0, ".0f"),
    ("corner_rms_px", "corner px", 1.0, ".3f"),
    ("range_error_median_mm", "range mm", 1.0, ".2f"),
    ("heading_error_median_deg", "head. deg", 1.0, ".3f"),
    ("anees_6", "ANEES/6", 1.0, ".2f"),
    ("anees_4", "ANEES/4", 1.0, ".2f"),
    ("window_ms", "window ms", 1.0, ".2f"),
    ("acquire_ms", "acquire ms", 1.0, ".1f"),
    ("search_ms", "search ms", 1.0, ".1f"),
)


def page_of(result: dict[str, Any]) -> str:
    """Return everything as text."""
    lines = ["640x360, f 460 px, 44 mm squares; medians; CPU of one thread", ""]
    for name in ("clean", "realistic"):
        title = "clean" if name == "clean" else "with 0.2 px corner noise"
        lines += _table(f"distance, {title}", [(f"{row['range_m']:g} m", row) for row in result[name]])
    steep = [(f"{low:g}-{high:g} deg", row) for row in result["steepness"] for low, high in [row["steepness_deg"]]]
    lines += _table("angle to the board's normal at 1.5 m, clean", steep)
    rows = [(f"{row['condition']}, {row['range_m']:g} m", row) for row in result["conditions"]]
    lines += _table("picture quality", rows)
    identities, peer, team = result["identities"], result["peer"], result["team"]
    flips = ", ".join(f"{row['flips']} of {row['sightings']} at {row['range_m']:g} m" for row in result["flips"])
    lines += [
        f"identities (0.2 px, 1-4 m): {identities['sure']} sure of {identities['pictures']}, "
        f"{identities['wrong']} wrong",
        f"planar flips after gravity (0.2 px): {flips}",
        f"search of whole pictures: ours {peer['ours_found']:.0%} in {peer['ours_ms']:.1f} ms, OpenCV's sector-based "
        f"finder {peer['peer_found']:.0%} in {peer['peer_ms']:.1f} ms: {peer['cpu_ratio']:.1f} times the CPU",
        f"three drones and a ceiling camera at 15 fps: rendering {team['render_cores']:.2f}, detection "
        f"{team['detect_cores']:.2f} cores, {team['sightings_per_frame']:.1f} sightings per instant",
        "",
    ]
    for target in result["targets"]:
        mark = "ok" if target["ok"] else "NO"
        lines.append(f"{mark:>3}  {target['name']:45} {target['value']:8.3f}  {target['relation']} {target['limit']:g}")
    return "\n".join(lines)


def _table(title: str, rows: list[tuple[str, dict[str, Any]]]) -> list[str]:
    shown = [column for column in _COLUMNS if any(row.get(column[0]) is not None for _, row in rows)]
    lines = [title, f"{'':28}" + "".join(f"{heading:>11}" for _, heading, _, _ in shown)]
    for name, row in rows:
        cells = (_cell(row.get(key), scale, form) for key, _, scale, form in shown)
        lines.append(f"{name:28}" + "".join(f"{cell:>11}" for cell in cells))
    return [*lines, ""]


def _cell(value: float | None, scale: float, form: str) -> str:
    return "-" if value is None else format(scale * value, form)


def plot(result: dict[str, Any], folder: Path) -> None:
    """Write vision.png: rates, errors, consistency and cost by distance, and rates by steepness and picture quality."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 3, figsize=(15, 8.5))
    clean, real = result["clean"], result["realistic"]
    distance = [row["range_m"] for row in clean]

    def curve(
        place: Any, rows: list[dict[str, Any]], key: str, label: str, scale: float = 1.0, style: str = "o-"
    ) -> None:
        values = [float("nan") if row[key] is None else scale * row[key] for row in rows]
        place.plot(distance, values, style, label=label)

    for key, label in (("followed", "window of a track"), ("acquired", "window of the belief"), ("searched", "search")):
        curve(axes[0][0], clean, key, f"{label}, clean", 100.0)
        curve(axes[0][0], real, key, f"{label}, 0.2 px", 100.0, "x--")
    curve(axes[0][0], clean, "identified", "identity read, clean", 100.0, "s:")
    _dress(axes[0][0], "distance [m]", "found [%]")
    for rows, label in ((clean, "clean"), (real, "0.2 px")):
        curve(axes[0][1], rows, "range_error_median_mm", f"range [mm], {label}")
        curve(axes[0][1], rows, "heading_error_median_deg", f"heading [deg], {label}", 1.0, "x--")
        curve(axes[0][2], rows, "anees_6", f"pose (6), {label}")
        curve(axes[0][2], rows, "anees_4", f"as reported (4), {label}", 1.0, "x--")
    axes[0][1].set_yscale("log")
    _dress(axes[0][1], "distance [m]", "median error")
    axes[0][2].axhspan(0.6, 1.5, alpha=0.15)
    _dress(axes[0][2], "distance [m]", "normalised error squared per degree of freedom")
    for key, label in (
        ("window_ms", "window of a track"),
        ("acquire_ms", "window of the belief"),
        ("search_ms", "search"),
    ):
        curve(axes[1][0], clean, key, label)
    axes[1][0].set_yscale("log")
    _dress(axes[1][0], "distance [m]", "CPU [ms]")
    steep = result["steepness"]
    axes[1][1].plot([sum(row["steepness_deg"]) / 2 for row in steep], [_percent(row) for row in steep], "o-")
    _dress(axes[1][1], "angle to the normal at 1.5 m [deg]", "found in the window [%]")
    for condition in dict.fromkeys(row["condition"] for row in result["conditions"]):
        rows = [row for row in result["conditions"] if row["condition"] == condition]
        axes[1][2].plot([r["range_m"] for r in rows], [_percent(r) for r in rows], "o-", label=condition)
    _dress(axes[1][2], "distance [m]", "found in the window [%]")
    figure.tight_layout()
    figure.savefig(folder / "vision.png", dpi=110)
    pyplot.close(figure)


def _percent(row: dict[str, Any]) -> float:
    return float("nan") if row["followed"] is None else 100.0 * float(row["followed"])


def _dress(place: Any, across: str, up: str) -> None:
    place.set_xlabel(across)
    place.set_ylabel(up)
    place.grid(alpha=0.3)
    if place.get_legend_handles_labels()[0]:
        place.legend(fontsize=7)
