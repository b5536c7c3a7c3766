"""The README of a package names each of its modules."""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("groundstation", "drivers", "sim_bridge")
# Files that every package may have and that need no description.
USUAL = {"__init__.py", "__main__.py"}


def modules_of(package: Path) -> Iterator[Path]:
    """Yield the modules of a package and of its subpackages without a README of their own."""
    for path in sorted(package.iterdir()):
        if path.suffix == ".py" and path.name not in USUAL:
            yield path
        elif path.is_dir() and not (path / "README.md").exists():
            yield from modules_of(path)


def test_each_module_stands_in_the_readme_of_its_package() -> None:
    missing = []
    for readme in (path for top in PACKAGES for path in (ROOT / top).rglob("README.md")):
        named = set(re.findall(r"\w+", readme.read_text(encoding="utf-8")))
        missing += [f"{path.relative_to(ROOT)}" for path in modules_of(readme.parent) if path.stem not in named]
    assert not missing, "\n".join(missing)
