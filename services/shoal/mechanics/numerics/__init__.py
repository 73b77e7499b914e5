"""Building blocks of kernels: tiles of lanes, rows of numbers, sparse factors."""
