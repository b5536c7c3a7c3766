"""Files of a lab host: a unit that systemd reads, and an image made of existing files."""

import importlib.util
import json
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from groundstation.cli.exits import ExitCode

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "config" / "host" / "skein@.service"
CONTAINER = (ROOT / "config" / "host" / "Containerfile").read_text()
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd-analyze is not installed")
def test_systemd_finds_nothing_wrong_with_the_unit(tmp_path: Path) -> None:
    text = re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", UNIT.read_text(), flags=re.MULTILINE)
    copy = tmp_path / "skein@lab.service"
    copy.write_text(text.replace("User=skein", "User=root"))
    said = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(copy)], capture_output=True, text=True, timeout=60
    )
    ours = [line for line in said.stderr.splitlines() if "skein@" in line]
    assert ours == []


def test_a_stop_of_the_service_lands_first_and_a_failed_flight_is_not_repeated() -> None:
    settings = dict(line.split("=", 1) for line in UNIT.read_text().splitlines() if re.match(r"\w+=", line))
    assert (settings["KillSignal"], settings["KillMode"], settings["Restart"]) == ("SIGINT", "control-group", "no")
    assert "--anyway" not in settings["ExecStart"]
    assert settings["SuccessExitStatus"] == str(int(ExitCode.INTERRUPTED))
    assert int(settings["TimeoutStopSec"]) >= 120  # a landing and its report took 41 s on a busy computer


def test_the_image_copies_what_exists_and_starts_what_is_installed() -> None:
    sources = [source for line in re.findall(r"^COPY (.+)$", CONTAINER, re.MULTILINE) for source in line.split()[:-1]]
    assert [source for source in sources if not (ROOT / source).exists()] == []
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert set(packages["packages"]) <= set(sources)
    (entry,) = re.findall(r"^ENTRYPOINT (.+)$", CONTAINER, re.MULTILINE)
    python, option, module, program = json.loads(entry)
    assert (python, option) == ("python", "-m") and importlib.util.find_spec(module)
    assert program in PROJECT["scripts"]
    (base,) = re.findall(r"^ARG BASE=python:(\d+)\.(\d+)-slim$", CONTAINER, re.MULTILINE)
    least = tuple(map(int, PROJECT["requires-python"].removeprefix(">=").split(".")))
    assert tuple(map(int, base)) >= least
    assert "USER skein" in CONTAINER and "STOPSIGNAL SIGINT" in CONTAINER


def test_the_builder_is_sent_what_the_image_copies_and_nothing_else() -> None:
    sources = {source for line in re.findall(r"^COPY (.+)$", CONTAINER, re.MULTILINE) for source in line.split()[:-1]}
    sent = (ROOT / ".dockerignore").read_text().splitlines()
    assert "*" in sent and {line.removeprefix("!") for line in sent if line.startswith("!")} == sources
    assert "**/__pycache__" in sent[sent.index("!config") :]


def _container_program() -> str | None:
    for program in ("podman", "docker"):
        if shutil.which(program) and not subprocess.run([program, "info"], capture_output=True, timeout=30).returncode:
            return program
    return None


@pytest.fixture(scope="module")
def image() -> tuple[str, str]:
    """The program that builds and runs images, and our tag; with BUILDAH_ISOLATION=chroot also in a container."""
    program = _container_program()
    if program is None:
        pytest.skip("no podman and no docker that answers")
    (base,) = re.findall(r"^ARG BASE=(\S+)$", CONTAINER, re.MULTILINE)
    there = [[program, "image", "inspect", base], [program, "pull", base]]
    if all(subprocess.run(get, capture_output=True, timeout=600).returncode for get in there):
        pytest.skip(f"{base} is not here, and cannot be pulled")
    build = [program, "build", "--file", "config/host/Containerfile", "--tag", "skein-test", "."]
    subprocess.run(build, cwd=ROOT, check=True, timeout=1200)
    return program, "skein-test"


def _ran(image: tuple[str, str], *arguments: str, options: tuple[str, ...] = ()) -> "subprocess.CompletedProcess[str]":
    program, tag = image
    command = [program, "run", "--rm", "--network", "none", *options, tag, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=400)


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_the_image_is_built_and_says_its_version_as_nobody_special(image: tuple[str, str]) -> None:
    assert PROJECT["version"] in _ran(image, "--version").stdout
    assert _ran(image, "-un", options=("--entrypoint", "id")).stdout.strip() == "skein"


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.timeout(1500)
def test_a_demo_is_flown_and_kept_by_the_image(image: tuple[str, str], tmp_path: Path) -> None:
    tmp_path.chmod(0o777)  # for the image's own user
    volume = ("--volume", f"{tmp_path}:/runs", "--cap-add", "SYS_NICE")
    said = _ran(image, "demo", "--headless", "--duration", "20", options=volume)
    assert "all drones have landed" in said.stdout, said.stdout + said.stderr
    assert list(tmp_path.glob("*-lab/report.html")), said.stdout
