"""A room from above, in characters: walls, fence, the ceiling camera's view, pads."""

from groundstation.settings.new_field import NewRoom, Place, pads

_COLUMNS, _METRES_ABOVE_FLOOR = 56, 1.0


def room_text(room: NewRoom, drones: int) -> str:
    """Return a drawing to scale, x to the right, y upwards; digits: pads; dots: seen by the ceiling camera at 1 m."""
    columns = _COLUMNS
    rows = max(6, round(columns * room.width_m / room.length_m / 2))
    canvas = [[" "] * columns for _ in range(rows)]
    half_x, half_y = room.half_view_m(_METRES_ABOVE_FLOOR)
    for row in range(rows):
        for column in range(columns):
            x, y = _place(room, (column + 0.5) / columns, (row + 0.5) / rows)
            if abs(x) <= half_x and abs(y) <= half_y:
                canvas[row][column] = "."
    for number, (x, y) in enumerate(pads(room, drones), 1):
        right, down = x / room.length_m + 0.5, 0.5 - y / room.width_m
        canvas[min(rows - 1, int(down * rows))][min(columns - 1, int(right * columns))] = f"{number}"[-1]
    edge = "+" + "-" * columns + "+"
    return "\n".join([edge, *("|" + "".join(line) + "|" for line in canvas), edge])


def _place(room: NewRoom, right: float, down: float) -> Place:
    return (right - 0.5) * room.length_m, (0.5 - down) * room.width_m
