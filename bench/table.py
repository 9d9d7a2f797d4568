"""Tables in Markdown."""


def table(head, rows):
    """Returns the lines of a table. Columns of numbers are aligned to the right; short rows are filled up."""
    rows = [[str(cell) for cell in row] + [""] * (len(head) - len(row)) for row in rows]
    is_number = lambda cells: any(cells) and all(cell[:1].isdigit() for cell in cells if cell)
    rule = ["---:" if is_number([row[k] for row in rows]) else "---" for k in range(len(head))]
    return ["| " + " | ".join(cells) + " |" for cells in (head, rule, *rows)]


def starred(figure, is_met):
    """Returns the figure, with a star if it misses its bar."""
    return figure if is_met else f"{figure} *"
