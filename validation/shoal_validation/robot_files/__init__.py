"""Public robot files: how many are imported, why others are not, and whether they move as MuJoCo moves them."""
