"""The live terminal table: what the bus says, as a state, and the state as a picture."""
