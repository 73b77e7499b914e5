# %% [markdown]
# A slider-crank with rods of equal length: whenever the slider passes the bearing of the crank, the mechanism could
# as well go on by turning about it, with the slider at rest. The equations of motion are singular there.

# %%
import numpy as np
import shoal
from scipy.integrate import solve_ivp

scene = shoal.load_scene("equal-slider-crank")
motion = shoal.simulate(scene)

# %% [markdown]
# The branch on which the slider moves has one angle a, with Lagrange's equation
# (2/3 + 2 sin² a) a'' + 2 sin a cos a a'² + g cos a = 0 (1 m and 1 kg each). The slider is at 2 cos a.


# %%
def lagrange(_: float, state: list[float]) -> list[float]:
    a, rate = state
    return [rate, -(9.81 * np.cos(a) + 2 * np.sin(a) * np.cos(a) * rate**2) / (2 / 3 + 2 * np.sin(a) ** 2)]


one_angle = solve_ivp(lagrange, (0, 10), [np.pi / 4, 6.0], "DOP853", t_eval=motion.times, rtol=1e-13, atol=1e-13)
slider = 2 * np.cos(one_angle.y[0])
error = float(np.max(np.abs(motion.marker("B")[:, 0] - slider)))
passes = int(np.count_nonzero(np.diff(np.sign(slider))))
print(f"{passes} passes in {motion.times[-1]:g} s, off by at most {error:.1e} m")

# %% [markdown]
# Others on the same machine: multipliers by the usual matrix, our own method blind to the rank of the constraints
# (it takes the wrong branch with clean energy, which only a second run shows), and Exudyn's trapezoidal rule, whose
# Newton iteration ends at the position. Its damped generalized-alpha passes (docs/accuracy-and-speed.md).

# %%
others = {
    "multipliers": shoal.simulate(scene, set={"solver.acceleration": "kkt"}),
    "blind to rank": shoal.simulate(scene, set={"solver.rank_tolerance": 1e-14}),
    "Exudyn": shoal.simulate(scene, engine="exudyn", verify=False),
}
for name, run in others.items():
    print(f"{name}: {run.status[0]}: {run.message}")

# %%
shoal.plot(motion).save("singular.png")
