"""Driver of the Ryze Tello and of the RoboMaster TT: text over UDP."""
