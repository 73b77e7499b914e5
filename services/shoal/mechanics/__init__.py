"""The native solver: rigid-flexible dynamics by Gauss's principle, compiled, many lanes at once."""

import shoal.compile  # noqa: F401 - sets the folder of compiled kernels before Numba is imported
