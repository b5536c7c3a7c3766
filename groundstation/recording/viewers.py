"""What viewers understand without knowing us: channels in the layout of well-known Foxglove types."""

TF_CHANNEL = "/tf"
LOG_CHANNEL = "/log"
# Derived from messages that are recorded on their own channels too; our reader passes them over.
VIEWER_CHANNELS = frozenset((TF_CHANNEL, LOG_CHANNEL))
