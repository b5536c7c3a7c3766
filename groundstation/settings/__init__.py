"""The field file: its model, how it is read, and which part of it each process is handed."""
