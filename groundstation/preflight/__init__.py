"""What is looked at before a take-off: links, cameras, and who stands where."""
