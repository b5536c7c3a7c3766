"""The field file: its model, its reading and checks, and the section that each process gets."""
