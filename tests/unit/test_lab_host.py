"""What runs a lab host: the unit is one that systemd reads, the image is made of files that exist."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

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
    assert (settings["KillSignal"], settings["KillMode"], settings["Restart"]) == ("SIGINT", "mixed", "no")
    assert "--anyway" not in settings["ExecStart"]


def test_the_image_copies_what_exists_and_starts_what_is_installed() -> None:
    sources = [source for line in re.findall(r"^COPY (.+)$", CONTAINER, re.MULTILINE) for source in line.split()[:-1]]
    assert [source for source in sources if not (ROOT / source).exists()] == []
    packages = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert set(packages["packages"]) <= set(sources)
    (program,) = re.findall(r'^ENTRYPOINT \["(\S+)"\]$', CONTAINER, re.MULTILINE)
    assert program in PROJECT["scripts"]
    (python,) = re.findall(r"^FROM python:(\d+)\.(\d+)-slim$", CONTAINER, re.MULTILINE)
    least = tuple(map(int, PROJECT["requires-python"].removeprefix(">=").split(".")))
    assert tuple(map(int, python)) >= least
    assert "USER skein" in CONTAINER and "STOPSIGNAL SIGINT" in CONTAINER


def _container_program() -> str | None:
    for program in ("podman", "docker"):
        if shutil.which(program) and not subprocess.run([program, "info"], capture_output=True, timeout=30).returncode:
            return program
    return None


@pytest.mark.slow
def test_the_image_is_built_and_says_its_version() -> None:
    program = _container_program()
    if program is None:
        pytest.skip("no podman and no docker that answers")
    tag = "skein-test"
    build = [program, "build", "--file", "config/host/Containerfile", "--tag", tag, "."]
    subprocess.run(build, cwd=ROOT, check=True, timeout=1200)
    command = [program, "run", "--rm", "--network", "none", tag, "--version"]
    said = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert PROJECT["version"] in said.stdout
