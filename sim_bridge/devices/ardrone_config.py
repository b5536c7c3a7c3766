"""The configuration of an emulated AR.Drone: values, write access, sets of sessions, users and applications."""

from collections.abc import Mapping

from drivers.ardrone.wire.configuration import CONFIGURATION, Access, Category, ConfigKey, Scalar, parse_value
from drivers.ardrone.wire.errors import WireError
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware

DEFAULT_ID = "00000000"
_COMMON = Category.COMMON
Ids = tuple[str, str, str]  # session, user, application: the order of CONFIG_IDS
NO_IDS: Ids = (DEFAULT_ID,) * 3
_SWITCHES = {
    "custom:session_id": Category.SESSION,
    "custom:profile_id": Category.USER,
    "custom:application_id": Category.APPLICATION,
}
_DESCRIPTIONS = {
    Category.APPLICATION: "custom:application_desc",
    Category.USER: "custom:profile_desc",
    Category.SESSION: "custom:session_desc",
}
# A drone's flash is finite, and so is our memory: the oldest set is dropped.
_MOST_SETS = 32


class Configuration:
    """Keys and values of one drone: one common set, and sets by id for the other categories."""

    def __init__(self, firmware: ArdroneFirmware = FIRMWARES[DEFAULT]) -> None:
        self._firmware = firmware
        self._keys = {
            name: key for name, key in CONFIGURATION.items() if key.generation in (0, firmware.generation)
        }  # in the order of a dump
        self._common = self._fresh(Category.COMMON)
        self._sets = {category: {DEFAULT_ID: self._fresh(category)} for category in _DESCRIPTIONS}
        self._active = dict.fromkeys(_DESCRIPTIONS, DEFAULT_ID)

    @property
    def active_ids(self) -> Ids:
        """Return the active ids (session, user, application), which CONFIG_IDS has to name."""
        active = self._active
        return active[Category.SESSION], active[Category.USER], active[Category.APPLICATION]

    @property
    def values(self) -> dict[str, Scalar]:
        """Return the settings in force, in the order of a dump."""
        return {name: self._value(key) for name, key in self._keys.items()}

    @property
    def descriptions(self) -> Mapping[Category, Mapping[str, str]]:
        """Return id -> description of each category's sets."""
        return {
            category: {name: str(values[_DESCRIPTIONS[category]]) for name, values in sets.items()}
            for category, sets in self._sets.items()
        }

    def text(self, name: str) -> str:
        """Return a text."""
        return str(self._value(self._keys[name]))

    def real(self, name: str) -> float:
        """Return a number."""
        value = self._value(self._keys[name])
        assert isinstance(value, int | float)
        return float(value)

    def integer(self, name: str) -> int:
        """Return a whole number."""
        return int(self.real(name))

    def flag(self, name: str) -> bool:
        """Return a switch."""
        return self._value(self._keys[name]) is True

    def write(self, name: str, text: str, ids: Ids | None) -> bool:
        """Set a key as CONFIG does, clamped to its range; returns whether it took.

        ids: of the CONFIG_IDS before it in the same datagram. Unknown keys are acknowledged like any other by a real
        drone, so the answer is for the log only.
        """
        name = name.lower()
        key = self._keys.get(name)
        if key is None or key.access is Access.READ or not self._may_write(key, ids):
            return False
        if name in _SWITCHES:
            return self._firmware.multi_configuration and self._switch(_SWITCHES[name], text)
        try:
            self._set_of(key)[name] = parse_value(name, text)
        except WireError:
            return False
        self._follow(name)
        return True

    def _may_write(self, key: ConfigKey, ids: Ids | None) -> bool:
        if key.name in _SWITCHES or not self._firmware.multi_configuration:
            return True
        active = self.active_ids
        # WIRE: a write to a set that is not the active one is ignored (docs/reference/ardrone.md 5.3).
        if key.category is not Category.COMMON and tuple(map(str.lower, ids or NO_IDS)) != active:
            return False
        return key.access is not Access.CUSTOM or active != NO_IDS

    def _value(self, key: ConfigKey) -> Scalar:
        switched = _SWITCHES.get(key.name)
        return self._set_of(key)[key.name] if switched is None else self._active[switched]

    def _set_of(self, key: ConfigKey) -> dict[str, Scalar]:
        if key.category is _COMMON:
            return self._common
        return self._sets[key.category][self._active[key.category]]

    def _fresh(self, category: Category) -> dict[str, Scalar]:
        """Return a set with the values of the factory."""
        given = self._firmware.values
        return {name: given.get(name, key.default) for name, key in self._keys.items() if key.category is category}

    def _switch(self, category: Category, text: str) -> bool:
        """Switch to a set, make it if it is new, or delete it (`-id`, `-all`)."""
        sets, name = self._sets[category], text.removeprefix("-").lower()
        if text == "-all":
            for each in [each for each in sets if each != DEFAULT_ID]:
                del sets[each]
        elif len(name) != 8 or any(character not in "0123456789abcdef" for character in name):
            return False
        elif text.startswith("-"):
            if name != DEFAULT_ID:
                sets.pop(name, None)
        else:
            if name not in sets:
                sets[name] = self._fresh(category)
            self._active[category] = name
        self._forget_oldest(category)
        if self._active[category] not in sets:
            self._active[category] = DEFAULT_ID
        return True

    def _forget_oldest(self, category: Category) -> None:
        sets = self._sets[category]
        idle = [each for each in sets if each not in (DEFAULT_ID, self._active[category])]
        for each in idle[: max(0, len(sets) - _MOST_SETS)]:
            del sets[each]

    def _follow(self, name: str) -> None:
        """WIRE: `outdoor` selects which triple of limits is in force."""
        place = "outdoor" if self.flag("control:outdoor") else "indoor"
        for limit in ("euler_angle_max", "control_vz_max", "control_yaw"):
            if name in ("control:outdoor", f"control:{place}_{limit}"):
                chosen = self._keys[f"control:{limit}"]
                self._set_of(chosen)[chosen.name] = self._value(self._keys[f"control:{place}_{limit}"])
