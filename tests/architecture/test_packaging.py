"""Contents of the shipped package and state of the source tree."""

import importlib.util
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest

import groundstation

ROOT = Path(__file__).parents[2]
TOP_LEVEL = {
    *("pyproject.toml", "README.md", "groundstation", "drivers", "sim_bridge", "tests", "config"),
    *(
        "Makefile",
        "constraints.txt",
        "requirements",
        "LICENSE",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "docs",
    ),
}

CI_TARGETS = [
    *(".venv/.installed-check", ".venv/.installed-test-slow", "interop", "check", "docs", "test", "test-slow", "demo"),
]
MAKE_EXTRAS = ("test", "test-slow", "check", "docs")
HEAVY = ("distributed", "foxglove-sdk", "playwright", "pyarrow", "rerun-sdk")  # 0.9 of 2.1 GB


def project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def tracked() -> list[str]:
    result = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, timeout=30, check=False)
    if result.returncode != 0:
        pytest.skip("not a git checkout")
    return result.stdout.splitlines()


def shipped_modules() -> set[str]:
    packages = project()["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    return {str(path.relative_to(ROOT)) for name in packages for path in (ROOT / name).rglob("*.py")}


def test_every_folder_with_code_is_a_package() -> None:
    folders = {Path(name).parent for name in shipped_modules()}
    bare = [str(folder) for folder in folders if not (ROOT / folder / "__init__.py").is_file()]
    assert not bare, bare


def test_tests_and_config_are_no_packages() -> None:
    found = [str(path.relative_to(ROOT)) for name in ("tests", "config") for path in (ROOT / name).rglob("__init__.py")]
    assert not found, found


def test_test_files_have_names_of_their_own() -> None:
    """pytest runs in importlib mode: two files of one name would hide each other in reports."""
    names: dict[str, Path] = {}
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        assert path.name not in names, f"{path} and {names[path.name]}"
        names[path.name] = path


def test_distribution() -> None:
    settings = project()
    assert settings["project"]["name"] == "skein-groundstation"
    assert settings["project"]["requires-python"] == ">=3.11"
    assert settings["build-system"]["build-backend"] == "hatchling.build"
    assert settings["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"] == [
        "groundstation",
        "drivers",
        "sim_bridge",
    ]
    assert settings["project"]["scripts"]["groundstation"] == "groundstation.__main__:main"
    assert "Typing :: Typed" in settings["project"]["classifiers"]


def test_the_version_has_its_dated_entry() -> None:
    version = project()["project"]["version"]
    assert groundstation.__version__ == version
    newest = re.search(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    assert newest and re.fullmatch(rf"{re.escape(version)} \(20\d\d-\d\d-\d\d\)|not yet released", newest[1])


def test_dependencies_have_lower_bounds_and_exact_pins() -> None:
    settings = project()["project"]
    extras = settings["optional-dependencies"]
    wanted = settings["dependencies"] + [each for name in MAKE_EXTRAS for each in extras[name]]
    pins = dict(
        line.split("==") for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines() if "==" in line
    )
    pinned = {re.sub(r"[-_.]+", "-", name).lower() for name in pins}
    for requirement in wanted:
        if requirement.startswith(settings["name"]):
            continue  # another extra
        name = re.split(r"[<>=!~\[; ]", requirement)[0]
        assert re.search(r">=\s*\d", requirement), f"{requirement}: give a lower bound"
        assert "<" not in requirement, f"{requirement}: no upper cap in a library"
        assert re.sub(r"[-_.]+", "-", name).lower() in pinned, f"{name} is not pinned in constraints.txt"


def test_each_command_installs_what_it_uses() -> None:
    """The Makefile names existing extras; heavy ones are for the slow suite, the only one whose tests may need them."""
    settings = project()["project"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    installed = re.findall(r"\$\(STAMP\)-([a-z-]+)(?:  ## .*)?$", makefile, re.M)
    assert set(installed) == set(MAKE_EXTRAS)
    for name in ("dependencies", "test", "check", "docs"):
        listed = settings["dependencies"] if name == "dependencies" else settings["optional-dependencies"][name]
        assert not [each for each in listed if each.startswith(HEAVY)], name


def test_constraints_hold_no_addresses() -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    bad = [
        line for line in text.splitlines() if line and not re.fullmatch(r"(#.*|[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+)", line)
    ]
    assert not bad, bad
    assert "://" not in text


def test_top_level_is_fixed() -> None:
    found = {name.split("/")[0] for name in tracked()}
    strange = {name for name in found if not name.startswith(".")} - TOP_LEVEL
    assert not strange, strange


def test_markers_exist() -> None:
    options = project()["tool"]["pytest"]["ini_options"]
    names = {marker.split(":")[0] for marker in options["markers"]}
    assert names >= {"slow", "sitl", "fuzz", "interop", "browser", "statistics"}
    assert "--import-mode=importlib" in options["addopts"]
    assert options["filterwarnings"] == ["error"]


def test_shipped_settings_are_the_repository_s() -> None:
    """There is one copy: the package refers to config/, from which the wheel takes its own."""
    from groundstation.settings.files import SHIPPED

    assert SHIPPED.resolve() == ROOT / "config"


def test_wheel_contents(tmp_path: Path) -> None:
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling is not installed here: the wheel itself is not built")
    # A copy of what git tracks, so that nothing is written into the tree and nothing untracked is shipped.
    result = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    (wheel,) = tmp_path.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    assert shipped_modules() <= names
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == {
        "groundstation",
        "drivers",
        "sim_bridge",
    }
    assert "groundstation/settings/shipped/lab.yaml" in names
    assert "groundstation/settings/shipped/cameras/ceiling.yaml" in names
    assert {"groundstation/py.typed", "drivers/py.typed", "sim_bridge/py.typed"} <= names


def test_the_continuous_integration_run_is_sound(tmp_path: Path) -> None:
    """`.ci/run` runs every step in a copy with a Makefile of its own, reports what fails, and fails with it."""
    (tmp_path / ".ci").mkdir()
    script = tmp_path / ".ci" / "run"
    script.write_bytes((ROOT / ".ci" / "run").read_bytes())
    script.chmod(0o755)
    makefile = tmp_path / "Makefile"
    makefile.write_text(f"{' '.join(CI_TARGETS)}:\n\t@echo did $@ $(DEMO_ARGS)\n", encoding="utf-8")
    good = subprocess.run([str(script)], capture_output=True, text=True, timeout=60, check=False)
    assert good.returncode == 0, good.stdout + good.stderr
    done = [line for line in good.stdout.splitlines() if line.startswith("did ")]
    assert [line.split()[1] for line in done] == CI_TARGETS
    assert done[-1].startswith("did demo --headless --duration")
    passing = " ".join(name for name in CI_TARGETS if name != "check")
    makefile.write_text(f"check:\n\t@false\n{passing}:\n", encoding="utf-8")
    bad = subprocess.run([str(script)], capture_output=True, text=True, timeout=60, check=False)
    assert bad.returncode == 1
    assert bad.stdout.splitlines()[-1] == "== failed: check"


def test_the_continuous_integration_run_is_bounded() -> None:
    """All limits together stay below 85 minutes."""
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    limits = [int(limit) for limit in re.findall(r"^step \S+ (\d+) ", script.read_text(encoding="utf-8"), re.M)]
    assert len(limits) == 7
    assert sum(limits) + 30 * len(limits) <= 5100
