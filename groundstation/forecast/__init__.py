"""What a field will be worth before anybody flies: how well, where not, and what a failure costs."""
