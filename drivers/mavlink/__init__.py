"""Vehicles that speak MAVLink 2: PX4 and ArduPilot, over UDP, serial lines or MAVSDK."""
