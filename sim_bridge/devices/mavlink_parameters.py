"""Parameters of the emulated autopilots: factory values, and those for indoor flight.

Written from docs/reference/mavlink.md 1, 2, not taken from the driver, so that its omissions show.
"""

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import INT32, REAL32

_PX4_FACTORY: dict[str, float] = {
    "MAV_SYS_ID": 1,
    "SYS_HAS_GPS": 1,
    "EKF2_GPS_CTRL": 7,
    "EKF2_EV_CTRL": 15,
    "EKF2_HGT_REF": 1,
    "EKF2_RNG_CTRL": 1,
    "EKF2_MAG_TYPE": 0,
    "EKF2_IMU_CTRL": 7,
    "EKF2_NOAID_TOUT": 5_000_000,
    "COM_OBL_RC_ACT": 0,
    "COM_RC_IN_MODE": 3,
    "COM_RCL_EXCEPT": 0,
    "COM_LOW_BAT_ACT": 0,
    "COM_FLTT_LOW_ACT": 3,
    "COM_ACT_FAIL_ACT": 0,
    "COM_IMB_PROP_ACT": 0,
    "NAV_DLL_ACT": 0,
    "NAV_RCL_ACT": 2,
}
_PX4_REALS: dict[str, float] = {
    "EKF2_EV_DELAY": 0.0,
    "EKF2_EV_POS_X": 0.0,
    "EKF2_EV_POS_Y": 0.0,
    "EKF2_EV_POS_Z": 0.0,
    "EKF2_EVP_NOISE": 0.1,
    "COM_OF_LOSS_T": 1.0,
    "COM_DL_LOSS_T": 10.0,
    "COM_DISARM_LAND": 2.0,
    "MPC_LAND_CRWL": 0.3,
    "COM_DISARM_PRFLT": 10.0,
    "MIS_TAKEOFF_ALT": 2.5,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_V_AUTO_UP": 3.0,
}
_PX4_INDOOR: dict[str, float] = {
    "EKF2_GPS_CTRL": 0,
    "EKF2_EV_CTRL": 11,
    "EKF2_HGT_REF": 3,
    "EKF2_RNG_CTRL": 0,
    "EKF2_MAG_TYPE": 5,
    "EKF2_IMU_CTRL": 3,
    "EKF2_NOAID_TOUT": 900_000,
    "SYS_HAS_GPS": 0,
    "COM_OBL_RC_ACT": 4,
    "EKF2_EVP_NOISE": 0.05,
    "MPC_Z_V_AUTO_UP": 1.0,
    "COM_RC_IN_MODE": 0,
    "COM_RCL_EXCEPT": 4,
    "COM_FLTT_LOW_ACT": 1,
    "NAV_RCL_ACT": 3,
}
_COPTER_FACTORY: dict[str, float] = {
    "SYSID_THISMAV": 1,
    "SYSID_MYGCS": 255,
    "VISO_TYPE": 0,
    "GPS1_TYPE": 1,
    "EK3_SRC1_POSXY": 3,
    "EK3_SRC1_VELXY": 3,
    "EK3_SRC1_POSZ": 1,
    "EK3_SRC1_VELZ": 3,
    "EK3_SRC1_YAW": 1,
    "COMPASS_USE": 1,
    "COMPASS_USE2": 1,
    "COMPASS_USE3": 1,
    "ARMING_CHECK": 1,
    "FS_GCS_ENABLE": 0,
    "LAND_SPEED": 50,
    "FS_EKF_ACTION": 1,
    "FS_THR_ENABLE": 1,
    "RC_OPTIONS": 32,
    "BATT_FS_LOW_ACT": 0,
    "BATT_FS_CRT_ACT": 0,
    "FS_OPTIONS": 16,
    "DISARM_DELAY": 10,
    "VISO_DELAY_MS": 10,
}
_COPTER_REALS: dict[str, float] = {
    "GUID_TIMEOUT": 3.0,
    "FS_GCS_TIMEOUT": 5.0,
    "FS_EKF_THRESH": 0.8,
    "PILOT_TKOFF_ALT": 0.0,
    "VISO_POS_X": 0.0,
    "VISO_POS_Y": 0.0,
    "VISO_POS_Z": 0.0,
    "VISO_SCALE": 1.0,
}
_COPTER_INDOOR: dict[str, float] = {
    "VISO_TYPE": 1,
    "GPS1_TYPE": 0,
    "EK3_SRC1_POSXY": 6,
    "EK3_SRC1_VELXY": 6,
    "EK3_SRC1_POSZ": 6,
    "EK3_SRC1_VELZ": 6,
    "EK3_SRC1_YAW": 6,
    "COMPASS_USE": 0,
    "COMPASS_USE2": 0,
    "COMPASS_USE3": 0,
    "ARMING_CHECK": 1048574,
    "GUID_TIMEOUT": 0.5,
    "FS_GCS_ENABLE": 5,
    "FS_GCS_TIMEOUT": 2.0,
    "LAND_SPEED": 70,
    "FS_OPTIONS": 0,
    "FS_THR_ENABLE": 0,
    "RC_OPTIONS": 34,
}


class Parameters:
    """Values and kinds of one vehicle, in the order of its list; configured: for flight indoors."""

    def __init__(self, flavour: Flavour, system: int, configured: bool) -> None:
        self.flavour, self.system = flavour, system
        px4 = flavour is Flavour.PX4
        whole, real = (_PX4_FACTORY, _PX4_REALS) if px4 else (_COPTER_FACTORY, _COPTER_REALS)
        self.values = dict(sorted((whole | real).items()))
        self._reals = frozenset(real)
        self.values["MAV_SYS_ID" if px4 else "SYSID_THISMAV"] = system
        if configured:
            self.values |= _PX4_INDOOR if px4 else _COPTER_INDOOR
        self.names = list(self.values)

    def __getitem__(self, name: str) -> float:
        """Return a value."""
        return self.values[name]

    def kind(self, name: str) -> int:
        """Return the type by which a parameter is transmitted."""
        return REAL32 if name in self._reals else INT32

    @property
    def indoor(self) -> bool:
        """Return whether the estimator takes its position from outside."""
        if "EKF2_EV_CTRL" in self.values:
            return int(self.values["EKF2_EV_CTRL"]) & 1 == 1 and self.values["EKF2_GPS_CTRL"] == 0
        return self.values["VISO_TYPE"] == 1 and self.values["EK3_SRC1_POSXY"] == 6
