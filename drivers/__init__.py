"""Adapters between devices (vehicles, cameras and others) and the bus: one package per protocol, and shared parts."""
