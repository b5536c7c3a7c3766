"""Time constants of the errors of small drones' sensors, as recorded (docs/explanation/estimation.md 9.2).

Their sizes stand in the scenario.
"""

import math

HEIGHT_TICKS = 3
"""A new height about every 15 ms."""
HEIGHT_CORRELATION_S = 2.0
HEIGHT_WHITE_M = 0.005
VELOCITY_CORRELATION_S = 0.4
YAW_DRIFT_RAD_S = math.radians(0.0185)
