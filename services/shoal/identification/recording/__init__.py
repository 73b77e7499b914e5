"""From a recording as it is stated to samples in SI units: reading, mending, and what the numbers say by themselves."""
