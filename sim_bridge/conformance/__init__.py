"""The conformance kit: a kind's own driver flies its own emulator, and what is seen is judged check by check."""
