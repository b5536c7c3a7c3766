"""Names of a report's files in a run folder."""

HTML_NAME = "report.html"
JSON_NAME = "report.json"
PLOT_NAME = "trajectories.png"
