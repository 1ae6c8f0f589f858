"""One page of HTML that needs nothing else: no script, no font, no picture from elsewhere."""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files

STYLE = files("fieldcam.report") / "report.css"
SIMULATED = "Simulated data"
_ON_EVERY_SHEET = f'@page {{ @top-center {{ content: "{SIMULATED}"; }} }}\n'
MAX_NARROW_COLUMNS = 3
"""That fit on the screen of a phone."""
_LONG = ('<div class="wide', "<ul")
ALIGNMENTS = {"<": "", ">": ' class="number"'}


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def escaped(text: str) -> Html:
    """As markup, in which a number stays with its percent sign; what is markup already stays."""
    if isinstance(text, Html):
        return text
    return Html(html.escape(text).replace(" %", "\N{NO-BREAK SPACE}%"))


def page(title: str, parts: Iterable[str], simulated: bool = False) -> str:
    """A whole document; what is simulated is marked at its head and on every sheet of paper."""
    mark = element("p", SIMULATED, "simulated") if simulated else ""
    style = STYLE.read_text(encoding="utf-8") + (_ON_EVERY_SHEET if simulated else "")
    body = "\n".join(escaped(part) for part in parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escaped(title)}</title>\n"
        f"<style>\n{style}</style>\n</head>\n"
        f"<body>\n{mark}\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )


def element(name: str, text: str, kind: str = "") -> Html:
    """Such as a paragraph; `kind` is its class."""
    of = f' class="{kind}"' if kind else ""
    return Html(f"<{name}{of}>{escaped(text)}</{name}>")


def section(heading: str, *parts: str) -> Html:
    """On paper the heading stays with what follows it: with all of it, unless it is a table."""
    head, told = element("h2", heading), [escaped(part) for part in parts if part]
    start, rest = ([], told) if told and told[0].startswith(_LONG) else (told[:1], told[1:])
    kept = "\n".join([head, *start])
    inside = "\n".join([f'<div class="start">\n{kept}\n</div>', *rest])
    return Html(f"<section>\n{inside}\n</section>")


def figure(picture: Html, caption: str) -> Html:
    return Html(f"<figure>\n{picture}\n{element('figcaption', caption)}\n</figure>")


def listing(items: Iterable[str], kind: str = "") -> Html:
    """Empty where there is nothing to list."""
    inside = "\n".join(element("li", item) for item in items)
    of = f' class="{kind}"' if kind else ""
    return Html(f"<ul{of}>\n{inside}\n</ul>") if inside else Html("")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], alignment: str) -> Html:
    """`alignment` holds one of < and > for each column; a row of one cell is a heading.

    On a narrow screen a table of many columns becomes a list of each row's cells with their names.
    """
    columns = [_Column(name, ALIGNMENTS[side]) for name, side in zip(head, alignment, strict=True)]
    titles = "".join(f'<th scope="col"{each.of}>{escaped(each.name)}</th>' for each in columns)
    body = "\n".join(_row(row, columns) for row in rows)
    kind = "wide folding" if len(columns) > MAX_NARROW_COLUMNS else "wide"
    return Html(
        f'<div class="{kind}"><table>\n<thead><tr>{titles}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody>\n</table></div>"
    )


@dataclass(frozen=True, slots=True)
class _Column:
    name: str
    of: str
    """Its class, as an attribute."""


def picture(data: bytes, media_type: str, says: str) -> Html:
    """An image inside the page."""
    code = b64encode(data).decode("ascii")
    return Html(f'<img alt="{escaped(says)}" src="data:{media_type};base64,{code}">')


def _row(row: Sequence[str], columns: Sequence[_Column]) -> str:
    if len(row) == 1:
        return f'<tr><th scope="rowgroup" colspan="{len(columns)}">{escaped(row[0])}</th></tr>'
    cells = (
        f'<td{each.of} data-name="{escaped(each.name)}">{escaped(cell)}</td>'
        for each, cell in zip(columns, row, strict=True)
    )
    return f"<tr>{''.join(cells)}</tr>"
