"""How much of a foreign table is read; what is larger is refused in one sentence.

The largest table that anybody measured has some 10,000 rows.
"""

from __future__ import annotations

MOST_FILE_BYTES = 64 << 20
MOST_TEXT_BYTES = 16 << 20
"""Of a CSV table."""
MOST_UNPACKED_BYTES = 64 << 20
"""Of all parts of a workbook together."""
MOST_ROWS = 200_000
"""That hold something."""
LAST_ROW = 1_048_576
"""Of a sheet; spreadsheet programs end there."""
MOST_CELLS = 2_000_000
"""Of a sheet, empty ones before a filled one counted."""
MOST_SHEETS = 400
"""A day of the year each, and a few more."""
MOST_TITLE_ROWS = 20
"""That may stand above the heading."""
MOST_FRUITS = 30_000
"""Of a caliper table: 4,000 clusters take seconds, and room grows with their number."""
