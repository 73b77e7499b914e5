"""The request for the forces in the joints of a scene."""

from __future__ import annotations

from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated

from pydantic import BeforeValidator
from pydantic import Field as Constraint
from pydantic.dataclasses import dataclass

from shoal.requests import texts
from shoal.requests.fields import OfScene, Verify, instants
from shoal.requests.option import Option
from shoal.requests.request import STRICT

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt

    Instants = Sequence[float] | npt.NDArray[np.float64]
else:
    Instants = Annotated[
        list[float],
        Constraint(min_length=1),
        BeforeValidator(instants),
        Option(
            "Times of the motion [s].", "T,T,...", old="times", shown="Sequence[float] | ndarray", text=texts.numbers
        ),
    ]


@dataclass(frozen=True, config=STRICT)
class Reactions(OfScene):
    """Find the forces [N] and torques [N m] in the joints of a scene while it moves."""

    at: Instants
    _: KW_ONLY
    verify: Verify = True
