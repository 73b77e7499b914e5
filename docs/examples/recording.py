# %% [markdown]
# A real pendulum, its angle recorded by an encoder a thousand times a second. The data are those of Kaheman, Fasel,
# Bramburger, Strom, Kutz and Brunton, The Experimental Multi-Arm Pendulum on a Cart, arXiv:2205.06231 (2022), MIT
# licence: github.com/dynamicslab/MultiArm-Pendulum, ParameterEstimation. The recording is a CSV with the columns
# t [s] and theta [rad], pi hanging down.

# %%
import sys

import pandas as pd
import shoal

table = pd.read_csv(sys.argv[1])
estimate = shoal.identify("kaheman-single", table)
print(estimate)

# %% [markdown]
# Mass, inertia and friction are known in ratios only, and the answer says so. The ratio of weight to inertia does not
# depend on what was assumed for the others.

# %%
print(estimate.to_pandas()[["value", "std", "identifiable"]])
print(*estimate.combinations, sep="\n")
shoal.plot(estimate).save("recording.png")
ratio = estimate.quantities["G/J"].value
