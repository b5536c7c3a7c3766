"""Adapters between vehicles or cameras and the bus: one package per protocol, and what all of them share."""
