"""Adapters between vehicles or cameras and the bus: one package per protocol, and their shared parts."""
