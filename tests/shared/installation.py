"""Simulates the installation of a foreign package."""

from pathlib import Path


def install(folder: Path, package: str, entries: str) -> None:
    """Write a package's metadata and entry points into a folder of the import path."""
    info = folder / f"{package.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entries)
