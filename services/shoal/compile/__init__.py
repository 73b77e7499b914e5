"""Numba's inside, which no other package uses; docs/compile.md says why.

`deferred`, `linking`, `locks` and `operators` replace private functions of the one version of Numba that the package
depends on.
`pointers`, `structures`, `function_pointers`, `simd` and `vector` are instructions for kernels that Numba lacks.
`clock` and `progress` import nothing heavy: time limits do not count compilation, and users read what is compiled.
"""

from shoal.home import prepare_kernel_cache

prepare_kernel_cache()
