"""Fly one drone with PyPI `pyardrone`, by loops without a pause as its examples have them; prints a line of JSON.

Arguments: address of the drone, seconds forward.
"""

import json
import sys
import time

from pyardrone import ARDrone, at

address, seconds = sys.argv[1], float(sys.argv[2])
drone = ARDrone(host=address)
seen = {"ready": drone.navdata_ready.wait(5)}
drone.send(at.CONFIG("general:navdata_demo", False))
deadline = time.monotonic() + 5
while not hasattr(drone.navdata, "demo") and time.monotonic() < deadline:
    time.sleep(0.05)
seen["options"] = sorted(vars(drone.navdata))
seen["battery"] = drone.navdata.demo.vbat_flying_percentage
deadline = time.monotonic() + 10
while not drone.state.fly_mask and time.monotonic() < deadline:
    drone.takeoff()
seen["took_off"] = bool(drone.state.fly_mask)
while drone.navdata.demo.ctrl_state >> 16 != 4 and time.monotonic() < deadline:
    time.sleep(0.05)
seen["hovers"] = drone.navdata.demo.ctrl_state >> 16 == 4
end = time.monotonic() + seconds
while time.monotonic() < end:
    drone.move(forward=0.3)
    time.sleep(0.03)
seen["vx"] = drone.navdata.demo.vx
drone.hover()
time.sleep(1.0)
seen["altitude"] = drone.navdata.demo.altitude
seen["sent"] = 0
deadline = time.monotonic() + 15
while drone.state.fly_mask and time.monotonic() < deadline:
    drone.land()
    seen["sent"] += 1
seen["landed"] = not drone.state.fly_mask
drone.close()
print(json.dumps(seen))
