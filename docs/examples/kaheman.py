"""Write the recordings of a real pendulum as tables: single_1kHz.csv.gz and double_1kHz.csv.gz.

The data are those of Kaheman, Fasel, Bramburger, Strom, Kutz and Brunton, The Experimental Multi-Arm Pendulum on a Cart,
arXiv:2205.06231 (2022), MIT licence. In a clone of github.com/dynamicslab/MultiArm-Pendulum, whose commit e99a7e13 is
the one that was used, with the Python of Shoal's environment:

    python kaheman.py ParameterEstimation/DoublePendulum/DoublePendulumDataForParameterEstimation.mat

The file holds the recording in pieces: those for identification (`id`), then those for validation (`vad`).
"""

import sys

import numpy as np
import pandas as pd
import scipy.io

for path in sys.argv[1:]:
    pieces = scipy.io.loadmat(path)
    time, state = (
        np.concatenate([part for use in ("id", "vad") for part in pieces[f"{name}_{use}"].ravel()], axis)
        for name, axis in (("Time", 0), ("Y", 1))
    )
    arms = len(state) // 2  # Angles [rad], pi hanging down, then their rates [rad/s].
    names = [f"theta{arm + 1}" for arm in range(arms)] if arms > 1 else ["theta"]
    table = pd.DataFrame(dict(zip(["t", *names], [time.ravel().round(3), *state[:arms]], strict=True)))
    file = f"{('single', 'double', 'triple')[arms - 1]}_1kHz.csv.gz"
    table.to_csv(file, index=False, float_format="%.7g")
    print(f"{file}: {len(table)} samples of {', '.join(names)}, {table['t'].iloc[-1]:g} s")
