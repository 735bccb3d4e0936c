"""Readers and writers of tables of points as text: TRC and CSV."""
