"""Flies a vehicle with PyPI `dronekit` and its defaults; prints a line of JSON. Argument: the connection address."""

import collections
import collections.abc
import json
import sys
import time

setattr(collections, "MutableMapping", collections.abc.MutableMapping)  # noqa: B010  dronekit is older than Python 3.10

import dronekit  # noqa: E402

vehicle = dronekit.connect(sys.argv[1], wait_ready=True)
seen = {"parameters": len(vehicle.parameters), "fix": vehicle.gps_0.fix_type, "version": str(vehicle.version)}


def until(condition, seconds):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            print(json.dumps({**seen, "late": True}), flush=True)
            sys.exit(1)
        time.sleep(0.1)


until(lambda: vehicle.is_armable, 20)
vehicle.mode = dronekit.VehicleMode("GUIDED")
until(lambda: vehicle.mode.name == "GUIDED", 10)
vehicle.armed = True
until(lambda: vehicle.armed, 10)
vehicle.simple_takeoff(1.5)
until(lambda: vehicle.location.global_relative_frame.alt > 1.3, 20)
seen["height"] = vehicle.location.global_relative_frame.alt
home = vehicle.location.global_relative_frame
vehicle.simple_goto(dronekit.LocationGlobalRelative(home.lat + 3.0 / 111_319.0, home.lon, 1.5))
until(lambda: (vehicle.location.global_relative_frame.lat - home.lat) * 111_319.0 > 2.7, 20)
vehicle.mode = dronekit.VehicleMode("LAND")
until(lambda: not vehicle.armed, 30)
vehicle.close()
print(json.dumps(seen), flush=True)
