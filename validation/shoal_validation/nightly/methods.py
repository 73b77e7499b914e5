"""The methods of a night, one entry each: engine, settings, and how far from the reference each problem may end.

A method of fixed steps makes an error C h^p that no processor changes: runs that round otherwise agree in two digits
and more (`tests/validation/test_limits.py`). Its limit is some five times that, for mesh errors twice, so that a lost
order or a wrong step does not pass. Where round-off decides where the steps land, and with it the error, only theory
bounds it: those limits are `theory.bounds`. None says that no answer is expected, and that an answer would be a
failure: an engine that cannot do the scene says so, and a run that is wrong is rejected by its own checks.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from shoal_validation.nightly.theory import bounds

RIGID_PROBLEMS = (
    *("pendulum", "double-pendulum"),
    *("four-bar-2", "four-bar-40", "parallelogram", "slider-crank", "squeezer"),
)
FLEXIBLE_PROBLEMS = ("flexible-case-1", "flexible-case-2", "flexible-hanging")


@dataclass(frozen=True, kw_only=True)
class Method:
    """Method by which a problem is run.

    limits: largest error [m] by problem, None where no answer is expected; problems without one are left out
    reason: what the limit stems from; values: fields of the scene; verify: with estimated errors, as by default;
    tolerance: let the model be selected for it [m] instead; quick: whether a quick night has it; by_theory: whether
    the limits are what round-off may do, so that a larger error below them is no loss of accuracy
    """

    engine: str = "gauss"
    name: str
    limits: Mapping[str, float | None]
    reason: str
    values: Mapping[str, object] = field(default_factory=dict)
    verify: bool = False
    tolerance: float | None = None
    quick: bool = False
    by_theory: bool = False


def rigid(*limits: float | None) -> dict[str, float | None]:
    """Limits [m] in the order of RIGID_PROBLEMS."""
    return dict(zip(RIGID_PROBLEMS, limits, strict=True))


def without(limits: Mapping[str, float | None], *problems: str) -> dict[str, float | None]:
    """Limits but for some problems."""
    return {name: limit for name, limit in limits.items() if name not in problems}


def flexible(*limits: float) -> dict[str, float | None]:
    """Limits [m] in the order of FLEXIBLE_PROBLEMS."""
    return dict(zip(FLEXIBLE_PROBLEMS, limits, strict=True))


def integrator(name: str, **settings: object) -> dict[str, object]:
    """Fields of the scene that choose an integrator."""
    return {"solver.integrator": name, **{f"solver.{key}": value for key, value in settings.items()}}


def mesh(element: str, elements: tuple[int, int], **fields: object) -> dict[str, object]:
    """Fields of the scene that put a number of elements on both rods."""
    rods = zip(("OA", "AB"), elements, strict=True)
    return {
        f"bodies.{rod}.{key}": value
        for rod, count in rods
        for key, value in {"element": element, "elements": count, **fields}.items()
    }


def selection(tolerance: float, problems: Iterable[str], *, quick: bool) -> Method:
    """The model that is selected for an error [m], which must keep it."""
    return Method(
        name=f"selection, {tolerance:.0e} m".replace("e-0", "e-"),
        tolerance=tolerance,
        quick=quick,
        limits=dict.fromkeys(problems, tolerance),
        reason="the tolerance that was asked for",
    )


_RK4 = rigid(5e-10, 5e-9, 1e-8, 1e-8, 5e-9, 1e-7, 1e-10)
_TRAPEZOIDAL = rigid(5e-5, 2e-4, None, None, None, None, 2e-6)
_NOT_SINGULAR = "order 2 at the scene's step; on linkages that become singular Exudyn gives up"


def _of_open_chains(engine: str, name: str, tolerance: float) -> Method:
    """An engine in minimal coordinates, which follows a motion as closely as its tolerance lets it."""
    return Method(
        engine=engine,
        name=name,
        quick=True,
        limits=rigid(*[None] * len(RIGID_PROBLEMS)) | bounds(tolerance, "pendulum", "double-pendulum"),
        by_theory=True,
        reason=f"a tolerance of {tolerance:.0e} in every step, grown as the motion lets errors grow; it knows open "
        "chains only",
    )


RIGID = (
    Method(
        name="default, verified",
        verify=True,
        quick=True,
        limits=bounds(1e-12, *RIGID_PROBLEMS),
        by_theory=True,
        reason="order 8 at a relative tolerance of 1e-12 in every step, grown as the motion lets errors grow",
    ),
    selection(1e-4, RIGID_PROBLEMS, quick=True),
    Method(
        name="selection, 1e-6 m",
        tolerance=1e-6,
        limits=rigid(*[1e-6] * 7),
        reason="the tolerance that was asked for",
    ),
    Method(
        name="rk4",
        values=integrator("rk4"),
        quick=True,
        limits=_RK4,
        reason="order 4 at the scene's step",
    ),
    Method(
        name="leapfrog",
        values=integrator("leapfrog"),
        quick=True,
        limits=rigid(2e-5, 1e-4, 2e-3, 2e-3, 1e-3, 3e-3, 2e-6),
        reason="order 2 at the scene's step",
    ),
    Method(
        name="radau5, 1e-8",
        values=integrator("radau5", relative_tolerance=1e-8, absolute_tolerance=1e-9),
        limits=rigid(2e-7, 5e-7, 5e-5, 5e-5, 2e-5, 2e-5, 5e-8),
        reason="order 5 at a relative tolerance of 1e-8; singular positions cost two digits",
    ),
    Method(
        name="generalized-alpha",
        values=integrator("generalized-alpha"),
        limits=rigid(2e-4, 5e-4, 1e-3, 1e-3, 5e-4, 4e-3, 1e-5),
        reason="order 2, implicit, at the scene's step",
    ),
    Method(
        name="energy-momentum",
        values=integrator("energy-momentum"),
        limits=rigid(1e-4, 2e-4, 2.5e-4, 2.5e-4, 2.5e-4, 1.5e-3, 2e-6),
        reason="order 2 at the scene's step",
    ),
    Method(
        name="semi-implicit-euler",
        values=integrator("semi-implicit-euler"),
        quick=True,
        limits=rigid(*[None] * 7),
        reason="order 1 is wrong by up to metres at the scene's step, which the energy check has to see",
    ),
    Method(
        name="implicit-gauss",
        values=integrator("implicit-gauss"),
        limits=rigid(*[None] * 7),
        reason="order 1 is wrong by up to metres at the scene's step, which the energy check has to see",
    ),
    Method(
        name="rk4, kkt",
        values=integrator("rk4", acceleration="kkt"),
        limits=without(_RK4, "four-bar-40"),
        reason="the accelerations of the projection by another way",
    ),
    Method(
        name="rk4, augmented-lagrangian",
        values=integrator("rk4", acceleration="augmented-lagrangian"),
        limits=without(_RK4, "four-bar-40") | {"parallelogram": 3e-7},
        reason="the accelerations of the projection by iteration, which singular positions disturb",
    ),
    Method(
        name="rk4, proximal",
        values=integrator("rk4", acceleration="proximal"),
        limits=without(_RK4, "four-bar-40") | {"parallelogram": 1e-4},
        reason="the accelerations of the projection by iteration, which singular positions disturb",
    ),
    Method(
        name="rk4, baumgarte",
        values=integrator("rk4", acceleration="baumgarte"),
        limits=without(rigid(1e-7, 2e-7, 3e-5, None, 1e-5, 5e-6, 1e-10), "four-bar-40"),
        reason="stabilised instead of exact accelerations",
    ),
    Method(
        engine="exudyn",
        name="trapezoidal",
        quick=True,
        limits=_TRAPEZOIDAL,
        reason=_NOT_SINGULAR,
    ),
    Method(
        engine="exudyn-ge",
        name="trapezoidal",
        limits=without(_TRAPEZOIDAL, "four-bar-40"),
        reason=f"{_NOT_SINGULAR}; for rigid bodies the same model as exudyn",
    ),
    _of_open_chains("casadi", "cvodes", 1e-11),
    _of_open_chains("tree", "dop853", 1e-12),
)

_SCENE_MESH = flexible(7e-2, 8e-2, 4e-2)
_SCENE_REASON = "mesh error of the scene's own 2/4 cables, full quadrature"
_CABLES = {"quadrature": "reduced"}

FLEXIBLE = (
    Method(
        name="default, verified",
        verify=True,
        quick=True,
        limits=_SCENE_MESH,
        reason=_SCENE_REASON,
    ),
    *(selection(tolerance, FLEXIBLE_PROBLEMS, quick=tolerance >= 1e-3) for tolerance in (1e-2, 1e-3, 1e-4, 1e-5)),
    *(
        Method(
            name=f"4/8 cables, {name}",
            values=mesh("ancf-cable", (4, 8), **_CABLES) | integrator(name, **settings),
            quick=name == "leapfrog",
            limits=flexible(1e-2, 1e-2, 5e-3),
            reason="mesh error; that of time is a thousandth of it",
        )
        for name, settings in {
            "leapfrog": {"step": 2e-4},
            "rk4": {"step": 2e-4},
            "generalized-alpha": {"step": 5e-4},
            "energy-momentum": {"step": 5e-4},
            "radau5": {"relative_tolerance": 1e-6, "absolute_tolerance": 1e-7},
        }.items()
    ),
    *(
        Method(
            name=f"16/32 cables, {quadrature}",
            values=mesh("ancf-cable", (16, 32), quadrature=quadrature) | integrator("leapfrog", step=5e-5),
            limits=flexible(*[1.5e-4] * 3),
            reason="mesh error and that of time, alike",
        )
        for quadrature in ("reduced", "full")
    ),
    Method(
        name="2/4 quintic, leapfrog",
        values=mesh("ancf-quintic", (2, 4)) | integrator("leapfrog", step=2e-4),
        quick=True,
        limits=flexible(8e-3, 1.1e-2, 3e-3),
        reason="mesh error",
    ),
    *(
        Method(
            name=f"8/16 quintic, {name}",
            values=mesh("ancf-quintic", (8, 16)) | integrator(name, step=4e-5),
            quick=name == "leapfrog",
            limits=flexible(3.5e-5, 3e-5, 1.5e-5),
            reason="mesh error",
        )
        for name in ("leapfrog", "rk4")
    ),
    *(
        Method(
            name=f"8/16 fully parameterised, {law}",
            values=mesh("ancf-full", (8, 16), law=law) | integrator("generalized-alpha", step=5e-4),
            limits=limits,
            reason="mesh error of the low-order element",
        )
        for law, limits in {
            "enhanced": flexible(2e-2, 2e-2, 1e-2),
            "plane-stress": flexible(4e-2, 4e-2, 2.5e-2),
        }.items()
    ),
    *(
        Method(
            engine=engine,
            name="2/4 cables, full",
            quick=True,
            limits=_SCENE_MESH,
            reason=_SCENE_REASON,
        )
        for engine in ("exudyn", "casadi")
    ),
    Method(
        engine="exudyn",
        name="16/32 cables, reduced",
        values=mesh("ancf-cable", (16, 32), **_CABLES) | {"solver.step": 2.5e-4},
        limits=flexible(*[1.5e-4] * 3),
        reason="mesh error and that of time, alike",
    ),
    Method(
        engine="exudyn-ge",
        name="2/4 beams",
        quick=True,
        limits=flexible(5e-2, 6e-2, 5e-2),
        reason="mesh error of the three-node beam",
    ),
    Method(
        engine="exudyn-ge",
        name="16/32 beams",
        values=mesh("ancf-cable", (16, 32), **_CABLES) | {"solver.step": 2.5e-4},
        limits=flexible(*[2.5e-3] * 3),
        reason="mesh error, and the shear that the beam of the reference leaves out",
    ),
)
