"""Writes sheets as a PDF: black rectangles and Helvetica, no more than printing tags needs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fieldcam.report.tag_sheets import Paper, PaperSheet, Rectangle, Text

POINTS_PER_MM = 72 / 25.4
_CATALOG, _PAGES, _FONT, _FIRST_PAGE = 1, 2, 3, 4


def pdf_document(sheets: Sequence[PaperSheet], paper: Paper) -> bytes:
    """A whole file; each sheet is a page and what it shows."""
    numbers = range(_FIRST_PAGE, _FIRST_PAGE + 2 * len(sheets), 2)
    kids = " ".join(f"{number} 0 R" for number in numbers)
    # Without PrintScaling some viewers shrink the page to the printer's margins.
    bodies = [
        f"<< /Type /Catalog /Pages {_PAGES} 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        f"<< /Type /Pages /Kids [{kids}] /Count {len(sheets)} >>",
        "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
    ]
    for number, sheet in zip(numbers, sheets, strict=True):
        bodies += [_page(number + 1, paper), _stream("\n".join(_content(sheet)))]
    return _file(bodies)


def _page(content: int, paper: Paper) -> str:
    width, height = (side * POINTS_PER_MM for side in paper.value)
    return (
        f"<< /Type /Page /Parent {_PAGES} 0 R /MediaBox [0 0 {width:.4f} {height:.4f}]"
        f" /Resources << /Font << /F {_FONT} 0 R >> >> /Contents {content} 0 R >>"
    )


def _stream(text: str) -> str:
    return f"<< /Length {len(text)} >>\nstream\n{text}\nendstream"


def _content(sheet: PaperSheet) -> Iterator[str]:
    """In millimetres; all rectangles are one path, so that no seams show between them."""
    scale = f"{POINTS_PER_MM:.8f}"
    yield f"{scale} 0 0 {scale} 0 0 cm"
    yield from map(_rectangle, sheet.rectangles)
    yield "f"
    yield from map(_text, sheet.texts)


def _rectangle(box: Rectangle) -> str:
    return f"{box.x_mm:.4f} {box.y_mm:.4f} {box.width_mm:.4f} {box.height_mm:.4f} re"


def _text(line: Text) -> str:
    escaped = line.text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
    place = f"{line.x_mm:.4f} {line.y_mm:.4f}"
    return f"BT /F {line.height_mm:g} Tf {place} Td ({escaped}) Tj ET"


def _file(bodies: Sequence[str]) -> bytes:
    """Objects numbered from 1, and the table of where each begins."""
    written = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n"
    entries = [b"0000000000 65535 f \n"]
    for number, body in enumerate(bodies, 1):
        entries.append(b"%010d 00000 n \n" % len(written))
        written += b"%d 0 obj\n%s\nendobj\n" % (number, body.encode("ascii"))
    trailer = b"trailer\n<< /Size %d /Root %d 0 R >>\n" % (len(entries), _CATALOG)
    table = b"xref\n0 %d\n%s" % (len(entries), b"".join(entries))
    return written + table + trailer + b"startxref\n%d\n%%%%EOF\n" % len(written)
