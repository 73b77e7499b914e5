"""Bodies in a floating frame: modes of rods, modes that are given, and how they hang on coordinates."""
