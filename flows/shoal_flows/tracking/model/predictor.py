"""Predictor of a registered model: the motion of an identified machine. MLflow keeps this file with every model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from mlflow.models import set_model
from mlflow.pyfunc import PythonModel
from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification.recording.units import QUANTITIES
from shoal.scene import load_scene

TIME = "t [s]"


class IdentifiedMachine(PythonModel):  # type: ignore[misc]
    """Simulates the scene that was identified, of the first recording unless `params` name another."""

    def load_context(self, context: Any) -> None:
        """Read the scenes, by the name of the recording they belong to."""
        files = sorted((Path(context.artifacts["identification"]) / "scenes").glob("*.yaml"))
        self._scenes = {file.stem: load_scene(str(file)) for file in files}

    def predict(self, context: Any, model_input: pd.DataFrame, params: Mapping[str, Any] | None = None) -> pd.DataFrame:
        """Position [m] and angle [rad] of every marker at the times [s], a row for each row of the input.

        Raises InputError, and ComputationError if the motion cannot be trusted.
        """
        config = context.model_config
        recording = (params or {}).get("recording") or config["recording"]
        if recording not in self._scenes:
            raise InputError(f"recording: no {recording!r}; there are {', '.join(self._scenes)}")
        times, rows = np.unique(model_input[TIME].to_numpy(dtype=float), return_inverse=True)
        motion = get_engine(config["engine"]).simulate(self._scenes[recording], times)
        if not motion.ok:
            raise ComputationError(f"{motion.status[0]}: {motion.message}")
        table = motion.to_pandas()
        table.columns = [with_unit(name) for name in table.columns]
        return table.iloc[rows].reset_index(drop=True)


def with_unit(column: str) -> str:
    """A column of a trajectory with its unit: `B.x [m]`."""
    return f"{column} [{QUANTITIES[column.rpartition('.')[2]]}]"


set_model(IdentifiedMachine())
