"""The `groundstation` command: one small module per family of verbs, loaded when its verb is called."""
