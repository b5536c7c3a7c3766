"""The conformance kit: a kind's own driver flies its own emulator, and checks judge the flight."""
