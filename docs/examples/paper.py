# %% [markdown]
# The flexible double pendulum of the paper: two elastic rods, released from rest. From the motion of its tip, which
# Exudyn computes on a fine mesh, both initial angles are found on a coarse one.

# %%
import shoal

scene = shoal.load_scene("flexible-double-pendulum")
motion = shoal.simulate(scene)
print(motion, motion.to_pandas().iloc[-1])

# %% [markdown]
# The motion at a few instants, as a picture.

# %%
shoal.plot(scene).save("paper-motion.png")

# %% [markdown]
# What is sought, and from what, is a problem. The answer has a verdict; its intervals include the error of the mesh.

# %%
estimate = shoal.identify("paper-case-1")
print(estimate)
print(estimate.to_pandas()[["value", "lower", "upper"]])
shoal.plot(estimate).save("paper.png")

# %%
error = estimate.parameters["theta1"].value - estimate.truth["theta1"]
print(f"theta1 is off by {error:.1e} rad")
