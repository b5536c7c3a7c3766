"""The resolved field as typed values, for every process that reads one."""
