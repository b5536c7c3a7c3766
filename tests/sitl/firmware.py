"""Starts the SITL binaries that `$SKEIN_PX4` and `$SKEIN_ARDUCOPTER` name, on loopback, each in a folder of its own."""

import os
import subprocess
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

VARIABLES = {"px4": "SKEIN_PX4", "ardupilot": "SKEIN_ARDUCOPTER"}
# PX4 sends to 14540 + n, and its simulator sends the truth to 19410 + n; its system id is n + 1.
PX4_API, PX4_TRUTH = 14540, 19410
# Without a frame it never arms; our driver forbids take-off with an unknown battery.
_COPTER = {"FRAME_CLASS": 1.0, "FRAME_TYPE": 0.0, "BATT_MONITOR": 4.0}
# Also required: calibrated accelerometers, with a non-zero offset; there are two of them.
_COPTER |= {f"INS_ACC{number}OFFS_{axis}": 0.001 for number in ("", "2") for axis in "XYZ"}
_SAVED_S = 2.0


def binary_of(flavour: str) -> str:
    """Return the path of a binary, "" where its variable names none."""
    return os.environ.get(VARIABLES[flavour], "")


def ports_of(flavour: str, system: int) -> tuple[int, int]:
    """Return a firmware's destination ports: for telemetry, and for its vehicle's true state."""
    if flavour == "px4":
        return PX4_API + system - 1, PX4_TRUTH + system - 1
    return 25540 + system, 25640 + system


class Firmware:
    """One running binary; parameters: set before the first start; speed: its clock's maximum rate, real time = 1.

    `end` keeps the parameters set since.
    """

    def __init__(
        self, flavour: str, folder: Path, system: int, parameters: Mapping[str, float] | None = None, speed: float = 1.0
    ) -> None:
        self.flavour, self.folder, self.system, self.speed = flavour, folder, system, speed
        self.parameters = dict(parameters or {})
        self.port, self.truth_port = ports_of(flavour, system)
        self._starts = 0
        self.process = self._start()

    def restart(self) -> None:
        """End it once its parameters are on its disk, and start it again."""
        self.wait_saved()
        self.end()
        self.process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        self._starts += 1
        command, environment = self._px4() if self.flavour == "px4" else self._copter()
        log = (self.folder / f"log{self._starts}.txt").open("wb")
        sink = subprocess.DEVNULL
        with log:
            return subprocess.Popen(
                command, cwd=self.folder, env=environment, stdin=sink, stdout=log, stderr=subprocess.STDOUT
            )

    def _px4(self) -> tuple[list[str], dict[str, str]]:
        binary = binary_of("px4")
        environment = dict(os.environ)
        environment |= {"PX4_SYS_AUTOSTART": "10040", "PX4_SIM_MODEL": "sihsim_quadx", "PX4_SIMULATOR": "sihsim"}
        environment["PX4_SIM_SPEED_FACTOR"] = f"{self.speed:g}"
        presets = {"SENS_EN_GPSSIM": 0.0} | self.parameters
        environment |= {f"PX4_PARAM_{name}": f"{value:.7g}" for name, value in presets.items()}
        return [binary, "-i", str(self.system - 1), "-d", str(Path(binary).parents[1] / "etc")], environment

    def _copter(self) -> tuple[list[str], dict[str, str]]:
        defaults = self.folder / "defaults.parm"
        defaults.write_text("".join(f"{name} {value:.7g}\n" for name, value in (_COPTER | self.parameters).items()))
        quiet = [item for n in range(2, 9) for item in (f"--serial{n}", "none:")]
        command = [binary_of("ardupilot"), "--model", "quad", "--home", "47.4,8.5,488,0", "-I", str(self.system)]
        command += ["--sysid", str(self.system), "--defaults", str(defaults), "--speedup", f"{self.speed:g}"]
        command += [
            "--serial0",
            f"udpclient:127.0.0.1:{self.port}",
            "--serial1",
            f"udpclient:127.0.0.1:{self.truth_port}",
        ]
        return command + quiet + (["-w"] if self._starts == 1 else []), dict(os.environ)

    def wait_saved(self, limit_s: float = 20.0) -> None:
        """Wait until its parameter file has not changed for a while: PX4 writes it some time after a change."""
        names = ("parameters.bson", "parameters_backup.bson") if self.flavour == "px4" else ("eeprom.bin",)
        # An older file lacks a parameter set a moment ago: the first check comes after the time of writing.
        time.sleep(_SAVED_S)
        deadline = time.monotonic() + limit_s
        while time.monotonic() < deadline:
            ages = [
                time.time() - path.stat().st_mtime for path in (self.folder / name for name in names) if path.exists()
            ]
            if ages and min(ages) > _SAVED_S:
                return
            time.sleep(0.2)

    def end(self) -> None:
        """Stop the process."""
        self.process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(10)
        self.process.kill()
        self.process.wait()
