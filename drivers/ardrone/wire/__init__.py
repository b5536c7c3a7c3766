"""AR.Drone protocol as pure bytes: AT commands, navdata, state word, configuration keys; standard library only."""
