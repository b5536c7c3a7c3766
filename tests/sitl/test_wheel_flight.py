"""The wheel alone, in a clean environment: the product's commands work without the checkout."""

import json
import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(600)]

ROOT = Path(__file__).parents[2]


class Environment:
    """A virtual environment, and a working directory as of a user elsewhere."""

    def __init__(self, folder: Path) -> None:
        self.home = folder / "home"
        self.home.mkdir()
        venv.create(folder / "venv", with_pip=True)
        self.programs = folder / "venv" / "bin"
        (self.site_packages,) = (folder / "venv" / "lib").glob("python3*/site-packages")
        clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "GROUNDSTATION"))}
        self._variables = {**clean, "HOME": str(self.home), "XDG_CACHE_HOME": str(self.home / ".cache")}

    def run(self, name: str, *arguments: str, accepted: tuple[int, ...] = (0,)) -> str:
        """Return a program's output; fails unless it ends with an accepted exit code."""
        command = [str(self.programs / name), *arguments]
        done = subprocess.run(
            command, cwd=self.home, env=self._variables, capture_output=True, text=True, timeout=400, check=False
        )
        assert done.returncode in accepted, done.stdout + done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment with the wheel, and with the dependencies of the test's environment."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, capture_output=True, timeout=100, check=True)
    (wheel,) = folder.glob("*.whl")
    environment = Environment(folder)
    environment.run("pip", "install", "--no-deps", "--no-index", str(wheel))
    # Python reads no .pth files in a folder that a .pth file names: the editable checkout stays invisible.
    path_file = environment.site_packages / "dependencies.pth"
    path_file.write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return environment


def test_the_checkout_is_out_of_sight(installed: Environment) -> None:
    code = "import groundstation, drivers, sim_bridge as s; print(groundstation.__file__, drivers.__file__, s.__file__)"
    places = installed.run("python", "-c", code).split()
    assert len(places) == 3
    assert all(Path(place).is_relative_to(installed.site_packages) for place in places), places


@pytest.mark.parametrize("field", ["lab", "mixed-team", "two-targets"])
def test_the_shipped_fields_are_there(installed: Environment, field: str) -> None:
    installed.run("groundstation", "config", "check", field)


def test_the_demo_flies(installed: Environment) -> None:
    installed.run("python", "-m", "groundstation.runtime.compile_kernels")
    # The run fails the criterion that both topologies occur: it is too short for more than one.
    arguments = ("--headless", "--duration", "10", "--output", "judged")
    installed.run("groundstation", "demo", *arguments, accepted=(0, 1))
    judged = json.loads((installed.home / "judged" / "report.json").read_text(encoding="utf-8"))
    assert judged["landed"]
    assert judged["tracked_s"] > 5.0


def test_the_study_flies(installed: Environment) -> None:
    report = json.loads(installed.run("python", "-m", "sim_bridge.study", "demo", "--duration", "3", "--json"))
    assert report["target_rmse_m"] < 1.0
