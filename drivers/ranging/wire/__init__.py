"""Datagrams of ranges."""
