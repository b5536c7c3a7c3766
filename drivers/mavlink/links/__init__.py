"""The links to vehicles: UDP, a serial line, and MAVSDK over either of them."""
