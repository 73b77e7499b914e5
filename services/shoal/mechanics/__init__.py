"""The native solver: planar rigid-flexible dynamics by Gauss's principle, compiled, many lanes at once."""

from shoal.home import prepare_kernel_cache

prepare_kernel_cache()  # before Numba is first imported
