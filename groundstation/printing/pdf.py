"""A small PDF writer: black rectangles, lines and text at exact places in millimetres, nothing else.

Page coordinates: millimetres from the lower left corner of the page, y up.
"""

from dataclasses import dataclass, field

_POINTS_PER_MM = 72.0 / 25.4


@dataclass
class Page:
    """One page: its size [mm], and its content so far."""

    width_mm: float
    height_mm: float
    operators: list[str] = field(default_factory=list)

    def rectangle(self, x: float, y: float, width: float, height: float) -> None:
        """Fill a rectangle black; x, y: its lower left corner."""
        self.operators.append(f"0 g {_mm(x)} {_mm(y)} {_mm(width)} {_mm(height)} re f")

    def line(self, x0: float, y0: float, x1: float, y1: float, width_mm: float = 0.15) -> None:
        """Draw a thin black line."""
        self.operators.append(f"0 G {_mm(width_mm)} w {_mm(x0)} {_mm(y0)} m {_mm(x1)} {_mm(y1)} l S")

    def text(self, x: float, y: float, words: str, height_mm: float = 3.5, grey: float = 0.0) -> None:
        """Write one line in Helvetica, its base line beginning at (x, y)."""
        safe = words.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        self.operators.append(f"BT {grey:g} g /F1 {_mm(height_mm)} Tf {_mm(x)} {_mm(y)} Td ({safe}) Tj ET")


def encode(pages: list[Page], title: str) -> bytes:
    """Return a PDF 1.4 document; viewers are asked to print it without scaling."""
    kids = " ".join(f"{4 + 2 * index} 0 R" for index in range(len(pages)))
    objects = [
        "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(pages)} >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
    ]
    for index, page in enumerate(pages):
        box = f"[0 0 {page.width_mm * _POINTS_PER_MM:.4f} {page.height_mm * _POINTS_PER_MM:.4f}]"
        content = "\n".join([f"{_POINTS_PER_MM:.9f} 0 0 {_POINTS_PER_MM:.9f} 0 0 cm", *page.operators])
        resources = "<< /Font << /F1 3 0 R >> >>"
        objects += [
            f"<< /Type /Page /Parent 2 0 R /MediaBox {box} /Resources {resources} /Contents {5 + 2 * index} 0 R >>",
            f"<< /Length {len(content.encode('cp1252'))} >>\nstream\n{content}\nendstream",
        ]
    safe = title.replace("(", "").replace(")", "")
    objects.append(f"<< /Title ({safe}) >>")
    return _document(objects)


def _document(objects: list[str]) -> bytes:
    document, offsets = b"%PDF-1.4\n", []
    for number, content in enumerate(objects, start=1):
        offsets.append(len(document))
        document += f"{number} 0 obj\n{content}\nendobj\n".encode("cp1252")
    table = "".join(f"{offset:010d} 00000 n \n" for offset in offsets)
    trailer = (
        f"xref\n0 {len(objects) + 1}\n0000000000 65535 f \n{table}"
        f"trailer << /Size {len(objects) + 1} /Root 1 0 R /Info {len(objects)} 0 R >>\n"
        f"startxref\n{len(document)}\n%%EOF\n"
    )
    return document + trailer.encode("ascii")


def _mm(value: float) -> str:
    return f"{value:.4f}"
