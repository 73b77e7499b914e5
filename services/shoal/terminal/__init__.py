"""Output in a terminal: tables of 80 columns, progress on standard error."""
