"""Scenes from URDF and MJCF files, parsed by MuJoCo, and what of a file has no counterpart in a scene.

MuJoCo is imported when a file is read.
"""

from shoal.imported.read import Imported, read

__all__ = ["Imported", "read"]
