"""Software in the loop: drones, cameras and the TurtleBot, emulated at the wire."""
