"""The configuration of an emulated AR.Drone: values, who may write them, the ack bit, multi-configuration ids."""

from drivers.ardrone.wire.configuration import CONFIGURATION, Access, Category, Scalar, parse_value
from drivers.ardrone.wire.errors import WireError

DEFAULT_ID = "00000000"
_IDS = ("custom:session_id", "custom:profile_id", "custom:application_id")
Ids = tuple[str, str, str]  # session, user, application


class Configuration:
    """Keys and values of one drone."""

    def __init__(self) -> None:
        self.values: dict[str, Scalar] = {name: key.default for name, key in CONFIGURATION.items()}

    @property
    def active_ids(self) -> Ids:
        """Return the ids (session, user, application) that CONFIG_IDS has to name."""
        session, user, application = (str(self.values[name]) for name in _IDS)
        return session, user, application

    def real(self, name: str) -> float:
        """Return a number."""
        value = self.values[name]
        assert isinstance(value, int | float)
        return float(value)

    def integer(self, name: str) -> int:
        """Return a whole number."""
        return int(self.real(name))

    def flag(self, name: str) -> bool:
        """Return a switch."""
        return self.values[name] is True

    def write(self, name: str, text: str, ids: Ids | None) -> bool:
        """Set a key as CONFIG does, clamped to its range; returns whether it took.

        ids: of the CONFIG_IDS before it in the same datagram. Unknown keys are acknowledged like any other by a real
        drone, so the answer is for the log only.
        """
        name = name.lower()
        key = CONFIGURATION.get(name)
        if key is None or key.access is Access.READ:
            return False
        if name in _IDS:
            return self._switch(name, text)
        active = self.active_ids
        # WIRE: a write to a set that is not the active one is ignored (sheet 5.3).
        if key.category is not Category.COMMON and (ids or (DEFAULT_ID,) * 3) != active:
            return False
        if key.access is Access.CUSTOM and active == (DEFAULT_ID,) * 3:
            return False
        try:
            self.values[name] = parse_value(name, text)
        except WireError:
            return False
        self._follow(name)
        return True

    def _switch(self, name: str, text: str) -> bool:
        if text == "-all" or text == f"-{self.values[name]}":
            self.values[name] = DEFAULT_ID
        elif len(text) == 8 and all(character in "0123456789abcdefABCDEF" for character in text):
            self.values[name] = text
        else:
            return False
        return True

    def _follow(self, name: str) -> None:
        """WIRE: `outdoor` selects which triple of limits is in force."""
        place = "outdoor" if self.flag("control:outdoor") else "indoor"
        for limit in ("euler_angle_max", "control_vz_max", "control_yaw"):
            if name in ("control:outdoor", f"control:{place}_{limit}"):
                self.values[f"control:{limit}"] = self.values[f"control:{place}_{limit}"]
