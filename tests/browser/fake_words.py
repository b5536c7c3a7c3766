"""Status texts of the fake drones in each mode, and the mode that each command leads to."""

from groundstation.bus import messages as m

STATES = {
    "CONNECTING": m.FlightState.UNKNOWN,
    "LANDED": m.FlightState.LANDED,
    "CUT": m.FlightState.LANDED,
    "LANDING": m.FlightState.LANDING,
    "TAKING_OFF": m.FlightState.TAKING_OFF,
}
WHY = {"TRACK": "tracking for operator", "HOLD": "held by operator", "LANDING": "landing for operator"}
LEVEL = {m.Verb.HOLD: "HOLD", m.Verb.LAND: "LANDED", m.Verb.CUT_MOTORS: "CUT", m.Verb.TRACK: "TRACK"}
