"""MuJoCo: an independent engine in relative coordinates. Its library is imported when a scene is run."""

from shoal.engines.mujoco.engine import MujocoEngine

__all__ = ["MujocoEngine"]
