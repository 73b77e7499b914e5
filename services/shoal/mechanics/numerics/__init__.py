"""What kernels are made of: tiles of lanes, rows of numbers, sparse factors, calls through an address."""
