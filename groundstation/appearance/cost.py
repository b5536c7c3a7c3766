"""Costs of plans for display, always in cm². Messages and files keep m²."""

COST_UNIT = "cm²"
_CM2_PER_M2 = 1e4


def cost_cm2(cost_m2: float) -> float:
    """Return a cost [m^2] in the unit in which all costs are shown."""
    return cost_m2 * _CM2_PER_M2


def cost_figure(cost_m2: float) -> str:
    """Return a cost [m^2] in cm² without its unit, with three digits or all whole ones: 1.23, 45.6, 12345."""
    value = cost_cm2(cost_m2)
    return f"{value:.{2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0}f}"


def cost_text(cost_m2: float) -> str:
    """Return a cost [m^2] with its unit: "45.6 cm²"."""
    return f"{cost_figure(cost_m2)} {COST_UNIT}"
