"""What recorded flights tell of sensors: delays, and how cameras are mounted."""
