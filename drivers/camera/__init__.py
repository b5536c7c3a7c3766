"""The camera driver: pictures of a network camera in, relative observations of marked vehicles out."""
