"""The marker's exact layout: the printed marker equals the measured one."""

import numpy as np
import pytest

from groundstation.geometry import board
from groundstation.geometry.board import Checkerboard

BOARD = Checkerboard(code=5, square_mm=44.0)


def test_inner_corners_of_a_44_mm_board():
    corners = BOARD.corners()
    assert corners.shape == (12, 3)
    assert corners[0] == pytest.approx([-0.066, 0.044, 0.0])
    assert corners[3] == pytest.approx([0.066, 0.044, 0.0])
    assert corners[4] == pytest.approx([-0.066, 0.0, 0.0])
    assert corners[11] == pytest.approx([0.066, -0.044, 0.0])
    assert corners.mean(axis=0) == pytest.approx([0, 0, 0])


def test_the_card_is_290_mm_by_210_mm():
    outline = BOARD.outline()
    assert np.ptp(outline[:, 0]) == pytest.approx(0.290, abs=1e-3)
    assert np.ptp(outline[:, 1]) == pytest.approx(0.210, abs=1e-3)


def test_the_bar_stands_beyond_the_front_end():
    cells = board.cell_centres() * 44.0
    assert cells[:, 0] == pytest.approx(110.0 + 0.35 * 44.0 + 14.0)
    assert cells[0, 1] == pytest.approx(77.0)
    assert np.diff(cells[:, 1]) == pytest.approx(-22.0)


def test_code_words_differ_in_at_least_four_cells():
    words = board.CODE_WORDS
    distances = (words[:, None] != words[None]).sum(axis=-1)
    assert distances[~np.eye(16, dtype=bool)].min() == 4


def test_blank_paper_and_a_solid_bar_are_as_far_from_four_words_as_from_any():
    for bar in np.array((0, 1)):
        distances = np.sort((bar != board.CODE_WORDS).sum(axis=1))
        assert (distances[:4] == 2).all()


def test_golden_code_words():
    # By hand: data d1 d2 d3 d4, the parity of all seven, then d1^d2^d4, d1^d3^d4, d2^d3^d4; XOR 10010000.
    # Printed markers must never change.
    assert "".join(map(str, board.CODE_WORDS[0])) == "10010000"
    assert "".join(map(str, board.CODE_WORDS[1])) == "10000111"
    assert "".join(map(str, board.CODE_WORDS[5])) == "11001010"
    assert "".join(map(str, board.CODE_WORDS[15])) == "01101111"


@pytest.mark.parametrize("code", [-1, 16])
def test_there_are_sixteen_codes(code):
    assert list(board.VALID_CODES) == list(range(16))
    with pytest.raises(ValueError, match="code"):
        Checkerboard(code, 44.0)


def test_turning_the_board_by_180_degrees_swaps_the_colours():
    centres, black = board.square_centres()
    turned = [int(np.flatnonzero(np.isclose(centres, -c).all(axis=1))[0]) for c in centres]
    assert (black[turned] == ~black).all()


@pytest.mark.parametrize("texels", [4, 16, 33])
def test_the_raster_shows_squares_and_cells_where_they_belong(texels):
    picture, texel_from_marker = board.raster(5, texels)

    def grey(point):
        column, row, _ = texel_from_marker @ [*point, 1.0]
        return int(picture[round(row), round(column)])

    centres, black = board.square_centres()
    assert [grey(c) == board.BLACK for c in centres] == black.tolist()
    assert [grey(c) == board.BLACK for c in board.cell_centres()] == [bool(b) for b in board.CODE_WORDS[5]]
    x0, x1, y0, y1 = board.EXTENT
    assert grey((x0 + 0.15, y0 + 0.15)) == grey((x1 - 0.15, y1 - 0.15)) == board.WHITE


def test_the_raster_keeps_the_mean_grey():
    means = [board.raster(5, texels)[0].mean() for texels in (5, 11, 40)]
    assert max(means) - min(means) < 1.0
