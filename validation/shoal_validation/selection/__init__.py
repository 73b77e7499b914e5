"""Does `shoal simulate --tolerance` keep its word, and at what cost: random machines against finer models."""
