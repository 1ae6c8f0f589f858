class Cell:
    value: object
    row: int
    coordinate: str
