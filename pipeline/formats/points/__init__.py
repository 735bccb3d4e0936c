"""Tables of points as text: TRC and CSV, read and written."""
