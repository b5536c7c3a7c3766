"""Messages, topics and the Zenoh star that carries them between processes."""
