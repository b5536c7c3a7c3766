"""The links that vehicles are behind: UDP, a serial line, and MAVSDK over either of them."""
