"""The live terminal table: messages of the bus become a state, and the state a picture."""
