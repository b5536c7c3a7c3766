"""What this machine lacks for flying, and the remedy."""
