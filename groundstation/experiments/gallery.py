"""Draws the pictures of each experiment."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from groundstation.experiments.charts import save_errors, save_teams
from groundstation.experiments.figures import save_animation, save_topologies, save_trajectories
from groundstation.experiments.tasks import SETUPS, Task, simulate


def draw(
    folder: Path, tasks: Sequence[Task], rows: Sequence[dict[str, Any]], entries: Sequence[dict[str, Any]]
) -> None:
    """Draw the charts over all runs, and of each team the first run with our planner (or the first strategy)."""
    if len({entry["robots"] for entry in entries}) > 1 and tasks[0].experiment == "teams":
        save_teams(folder / "teams.png", entries)
    save_errors(folder / "errors.png", rows)
    strategies = [task.strategy for task in tasks]
    shown = "certified" if "certified" in strategies else strategies[0]
    if tasks[0].experiment == "teams":
        return
    drawn = {task.robots: task for task in reversed(tasks) if task.strategy == shown}
    for robots, task in sorted(drawn.items()):
        steps, setup = simulate(task), SETUPS[task.experiment]
        name, range_m = f"{task.experiment}-{robots}", setup.settings.range_m
        save_topologies(folder / f"{name}-topologies.png", steps, setup.parameters, range_m)
        title = f"{robots} robots, {shown}, seed {task.seed}"
        save_trajectories(folder / f"{name}-trajectories.png", steps, title)
        save_animation(folder / f"{name}.gif", steps, setup.parameters, range_m)
