"""The methods of a night for machines in space; see `methods`."""

from __future__ import annotations

from shoal_validation.nightly.methods import Method, integrator, mesh, selection
from shoal_validation.nightly.theory import bounds

_RIGID = ("spherical-pendulum", "bricard", "governor")
_PUBLISHED = {"bricard": 1e-9, "governor": 1e-7}
"""What was asked of the two whose reference is printed: [m] at the stated instants."""
_FLEXIBLE = "flexible-spherical"
_CABLES = {"quadrature": "reduced"}
_TOP, _STRIP = "heavy-top", "swinging-strip"
_NOTHING: dict[str, float | None] = dict.fromkeys((*_RIGID, _FLEXIBLE, _TOP, _STRIP))


def _rigid(*limits: float | None) -> dict[str, float | None]:
    """Limits [m] in the order of _RIGID."""
    return dict(zip(_RIGID, limits, strict=True))


IN_SPACE = (
    Method(
        name="default, verified",
        verify=True,
        quick=True,
        limits=bounds(1e-12, "spherical-pendulum", _TOP) | _PUBLISHED,
        by_theory=True,
        reason="order 8 at a relative tolerance of 1e-12 in every step, grown as the motion lets errors grow",
    ),
    Method(
        name="rk4",
        values=integrator("rk4"),
        quick=True,
        limits={"spherical-pendulum": 2e-10, "bricard": 3e-10, _TOP: 3e-8},
        reason="order 4 at the scene's step, and the reference's own error",
    ),
    Method(
        name="leapfrog",
        values=integrator("leapfrog"),
        limits={"spherical-pendulum": 5e-5, "bricard": 1e-6},
        reason="order 2 at the scene's step",
    ),
    Method(
        name="radau5, 1e-8",
        values=integrator("radau5", relative_tolerance=1e-8, absolute_tolerance=1e-9),
        limits=_rigid(2e-7, 5e-8, 1e-6),
        reason="order 5 at a relative tolerance of 1e-8",
    ),
    Method(
        name="generalized-alpha",
        values=integrator("generalized-alpha"),
        limits=_rigid(2e-4, 5e-6, 2e-4),
        reason="order 2, implicit, at the scene's step",
    ),
    Method(
        engine="exudyn",
        name="trapezoidal",
        quick=True,
        limits={**_rigid(1e-4, 5e-6, 2e-4), _TOP: 8e-4},
        reason="order 2 at the scene's step",
    ),
    *(selection(tolerance, (*_RIGID, _FLEXIBLE), quick=tolerance == 1e-3) for tolerance in (1e-3, 1e-4)),
    *(
        Method(
            engine=engine,
            name="4/8 cables, full",
            quick=True,
            limits={_FLEXIBLE: 5e-3},
            reason="mesh error of the scene's own cables",
        )
        for engine in ("gauss", "exudyn")
    ),
    *(
        Method(
            engine=engine,
            name="16/32 cables, reduced",
            values=mesh("ancf-cable", (16, 32), **_CABLES) | {"solver.step": step},
            limits={_FLEXIBLE: 1.2e-4},
            reason="mesh error",
        )
        for engine, step in (("gauss", 5e-5), ("exudyn", 2.5e-4))
    ),
    Method(
        name="8/16 quintic, leapfrog",
        values=mesh("ancf-quintic", (8, 16)) | integrator("leapfrog", step=4e-5),
        quick=True,
        limits={_FLEXIBLE: 1.5e-5},
        reason="mesh error",
    ),
    *(
        Method(engine=engine, name="as the scene says", quick=True, limits={_STRIP: limit}, reason="mesh error")
        for engine, limit in (("gauss", 1.8e-2), ("exudyn-ge", 1e-2))
    ),
    Method(engine="exudyn", name="director rods", quick=True, limits={_STRIP: None}, reason="its cables do not twist"),
    Method(
        engine="exudyn-ge",
        name="4/8 pairs of beams",
        limits={_FLEXIBLE: 2.8e-2},
        reason="mesh error of beams that shear, which are straight between frames",
    ),
    Method(engine="casadi", name="in space", quick=True, limits=_NOTHING, reason="it knows the plane only"),
)
