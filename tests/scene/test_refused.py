"""Every kind of bad input is refused in one line that names the field."""

from __future__ import annotations

import copy
import math
import re
from pathlib import Path
from typing import Any, get_args

import pytest
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.scene.bodies import Element

CABLES = load_scene("flexible-double-pendulum").model_dump()
CABLE_SCENE = load_scene("flexible-double-pendulum")
GONE = object()


def _changed(*changes: tuple[str, Any]) -> dict[str, Any]:
    """The flexible double pendulum as data, with fields set, added or (GONE) left out by dotted path."""
    data = copy.deepcopy(CABLES)
    for path, value in changes:
        *parents, leaf = path.split(".")
        place = data
        for part in parents:
            place = place[part]
        if value is GONE:
            del place[leaf]
        else:
            place[leaf] = value
    return data


ROD = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1000.0}
GROUNDS = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "ground", "point": [1.0, 0.0]}}


@pytest.mark.parametrize(
    ("change", "named", "why"),
    [
        pytest.param(("bodies.OA.density", -5540.0), "bodies.OA.density", "greater than 0", id="negative-density"),
        pytest.param(("bodies.OA.length", 0.0), "bodies.OA.length", "greater than 0", id="zero-length"),
        pytest.param(("bodies.OA.height", 1.5), "bodies.OA", "height 1.5 m is larger than the length 1 m", id="thick"),
        pytest.param(("bodies.AB.width", 2.5), "bodies.AB", "width 2.5 m is larger than the length 2 m", id="wide"),
        pytest.param(
            ("bodies.OA.colour", "red"), "bodies.OA.colour", "found 'red'; there are kind", id="unknown-body-field"
        ),
        pytest.param(("colour", "red"), "colour", "there are name, .*loads", id="unknown-scene-field"),
        pytest.param(("solver.stepp", 1), "solver.stepp", "did you mean step", id="unknown-solver-field"),
        pytest.param(("joints.A.damping", 1), "joints.A.damping", "there are .*friction", id="unknown-joint-field"),
        pytest.param(("bodies.OA", {"kind": "rod", "lenght": 1.0}), "bodies.OA.lenght", "mean length", id="misspelt"),
        pytest.param(("bodies.OA.length", math.nan), "bodies.OA.length", "finite", id="nan"),
        pytest.param(("gravity", [0.0, math.inf]), "gravity.1", "finite", id="infinite-gravity"),
        pytest.param(("gravity", [0.0]), "gravity", "at least 2 items", id="one-component-of-gravity"),
        pytest.param(("bodies.OA.length", "long"), "bodies.OA.length", "number", id="text-for-a-number"),
        pytest.param(
            ("bodies.OA.length", True), "bodies.OA.length", "needs a number, found True", id="yes-for-a-number"
        ),
        pytest.param(("gravity", [0.0, False]), "gravity", "needs a number, found .*False", id="no-in-a-vector"),
        pytest.param(("solver.samples", True), "solver.samples", "needs a number", id="yes-for-a-whole-number"),
        pytest.param(("bodies.OA.length", GONE), "bodies.OA.length", "required", id="missing-length"),
        pytest.param(
            ("bodies.OA.element", "brick"),
            "bodies.OA.element",
            " or ".join([", ".join(map(repr, get_args(Element)[:-1])), repr(get_args(Element)[-1])]),
            id="element",
        ),
        pytest.param(("bodies.OA.elements", 0), "bodies.OA.elements", "greater than or equal to 1", id="no-elements"),
        pytest.param(("bodies.OA.elements", 2.5), "bodies.OA.elements", "whole number", id="half-an-element"),
        pytest.param(("bodies.OA.quadrature", "half"), "bodies.OA.quadrature", "'full' or 'reduced'", id="quadrature"),
        pytest.param(("bodies.OA.youngs_modulus", GONE), "bodies.OA", "youngs_modulus is missing", id="no-modulus"),
        pytest.param(("bodies.OA.poisson_ratio", 0.7), "bodies.OA.poisson_ratio", "0.5", id="poisson"),
        pytest.param(("bodies.OA.element", GONE), "bodies.OA", "element is missing", id="moduli-without-an-element"),
        pytest.param(("bodies.OA.law", "lame"), "bodies.OA", "is for ancf-full", id="law-of-another-element"),
        pytest.param(("bodies.OA.rotary_inertia", True), "bodies.OA", "has none", id="rotary-inertia-of-a-cable"),
        pytest.param(("bodies.OA.kind", "blob"), "bodies.OA", "'rod', 'rigid-body'", id="unknown-kind-of-body"),
        pytest.param(
            ("bodies.OA.kind", GONE), "bodies.OA", "needs a kind, one of rod, rigid-body", id="no-kind-of-body"
        ),
        pytest.param(("bodies.ground", ROD), "bodies.ground", "fixed frame", id="a-body-called-ground"),
        pytest.param(("bodies", {}), "bodies", "at least 1", id="no-bodies"),
        pytest.param(("bodies.2nd", ROD), "bodies.2nd.[key]", "pattern", id="bad-name"),
        pytest.param(("bodies.C", ROD), "bodies.C", "no chain of joints connects it to the ground", id="disconnected"),
        pytest.param(("joints.O", GONE), "bodies.OA", "no chain of joints", id="chain-that-hangs-on-nothing"),
        pytest.param(("joints.A.second.body", "XY"), "joints.A.second.body", "no body 'XY'", id="missing-body"),
        pytest.param(("joints.A.first.point", "tip"), "joints.A.first.point", "no point 'tip'", id="missing-point"),
        pytest.param(("joints.A", GROUNDS), "joints.A", "joins 'ground' to itself", id="ground-to-ground"),
        pytest.param(("joints.O.first.point", "start"), "joints.O.first.point", r"\[x, y\]", id="name-on-the-ground"),
        pytest.param(("joints.A.first.point", [0.5, 0.01]), "joints.A.first.point", "axis of OA", id="joint-off-axis"),
        pytest.param(("joints.A.friction", -0.1), "joints.A.friction", "greater than or equal to 0", id="friction"),
        pytest.param(("joints.A.kind", "glue"), "joints.A", "'revolute'", id="unknown-joint"),
        pytest.param(("markers.B.point", [1.0, 0.01]), "markers.B.point", "axis of AB", id="marker-off-axis"),
        pytest.param(("markers.B.point", [2.1, 0.0]), "markers.B.point", "0 <= s <= 2", id="marker-past-the-end"),
        pytest.param(("markers.B.body", "ground"), "markers.B.body", "not on the ground", id="marker-on-the-ground"),
        pytest.param(("markers.B.body", "XY"), "markers.B.body", "no body 'XY'", id="marker-on-nothing"),
        pytest.param(("markers", {}), "markers", "at least 1", id="no-markers"),
        pytest.param(("initial.OA.angle", 45.0), "initial.OA.angle", "radians", id="degrees"),
        pytest.param(("initial.XY", {"angle": 1.0}), "initial.XY", "no such body", id="start-of-nothing"),
        pytest.param(("initial.OA.rate", math.inf), "initial.OA.rate", "finite", id="infinite-rate"),
        pytest.param(("solver.step", 0.0), "solver.step", "greater than 0", id="zero-step"),
        pytest.param(("solver.duration", -1.0), "solver.duration", "greater than 0", id="negative-duration"),
        pytest.param(("solver.samples", 0), "solver.samples", "greater than or equal to 1", id="no-samples"),
        pytest.param(("solver.integrator", "euler"), "solver.integrator", "'leapfrog'", id="unknown-integrator"),
        pytest.param(("solver.spectral_radius", 1.5), "solver.spectral_radius", "equal to 1", id="spectral-radius"),
        pytest.param(("name", GONE), "name", "required", id="no-name"),
    ],
)
def test_bad_data_is_refused_in_one_line_that_names_the_field(change: tuple[str, Any], named: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as refusal:
        Scene.parse(_changed(change), "my.yaml")
    line = str(refusal.value)
    assert "\n" not in line
    assert line.startswith(f"my.yaml: {named}: ")
    assert refusal.value.exit_status == 2


def test_several_mistakes_are_counted() -> None:
    with pytest.raises(InputError, match=r"^s: bodies\.AB\.length: .*\(and 1 more\)$|bodies\.OA") as refusal:
        Scene.parse(_changed(("bodies.OA.length", -1.0), ("bodies.AB.length", -1.0)), "s")
    assert "(and 1 more)" in str(refusal.value)


RIGID = """\
name: s
bodies:
  R: {kind: rod, length: 1.0, height: 0.02, width: 0.02, density: 1000.0}
joints:
  O: {first: {body: ground, point: [0, 0]}, second: {body: R}}
markers:
  E: {body: R, point: end}
"""


@pytest.mark.parametrize(
    ("text", "why"),
    [
        pytest.param(RIGID + "name: t\n", r"line 1: the key 'name' stands twice", id="duplicate-key"),
        pytest.param(
            RIGID.replace("length: 1.0,", "length: 1.0, length: 2.0,"), "'length' stands twice", id="duplicate-inside"
        ),
        pytest.param("name: [unclosed\nbodies: {", "line 2: ", id="not-yaml"),
        pytest.param("name: \x00", "not YAML", id="control-character"),
        pytest.param("- a\n- b\n", "a scene is a mapping of fields, found list", id="a-list"),
        pytest.param("", "a scene is a mapping of fields, found NoneType", id="empty"),
        pytest.param("just words", "a scene is a mapping of fields, found str", id="words"),
        pytest.param(RIGID + "extra: !!python/object/apply:os.getcwd []\n", "line 8: ", id="python-object"),
        pytest.param(RIGID.replace("1000.0", ".nan"), "bodies.R.density: .*finite", id="yaml-nan"),
        pytest.param(RIGID.replace("1000.0", "-1"), "bodies.R.density: .*greater than 0", id="yaml-negative"),
        pytest.param(RIGID.replace("{kind: rod, ", "{&a x: *a, "), "kind", id="recursive-alias"),
        pytest.param(RIGID + "? [1, 2]\n: x\n", "unhashable", id="a-key-that-is-a-list"),
        pytest.param("{{}: x}", "unhashable", id="a-key-that-is-a-mapping"),
        pytest.param("1: x\n", "required", id="a-key-that-is-a-number"),
        pytest.param("date: 2020-99-99\n", "month must be", id="an-impossible-date"),
        pytest.param("<<: 3\n", "line 1: ", id="a-merge-of-nothing"),
        pytest.param("a: " + "[" * 3000, "nested deeper", id="deep-nesting"),
    ],
)
def test_a_bad_file_is_refused_in_one_line_that_names_it(text: str, why: str, tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=why) as refusal:
        load_scene(str(file))
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).startswith(f"{file}: ")


def test_the_good_file_of_the_table_above_loads(tmp_path: Path) -> None:
    file = tmp_path / "good.yaml"
    file.write_text(RIGID, encoding="utf-8")
    assert load_scene(str(file)).bodies["R"].mass == pytest.approx(0.4, rel=1e-15)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        pytest.param("missing.yaml", "cannot be read: No such file", id="missing-file"),
        pytest.param("folder.yaml", "cannot be read: Is a directory", id="a-folder"),
        pytest.param("latin.yaml", "cannot be read: not UTF-8 text", id="not-utf-8"),
        pytest.param("no-such-scene", "no such scene; give a .yaml file or one of .*single-pendulum", id="no-name"),
        pytest.param("../library/single-pendulum", "no such scene", id="a-path-for-a-name"),
    ],
)
def test_a_scene_that_cannot_be_found_is_refused(
    name: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "latin.yaml").write_bytes("name: café".encode("latin-1"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=why) as refusal:
        load_scene(name)
    assert str(refusal.value).startswith(f"{name}: ")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("path", "value", "why"),
    [
        ("bodies.XY.length", 1.0, r"bodies\.XY\.length: no such field; bodies has OA, AB"),
        ("bodies.OA.lenght", 1.0, r"bodies\.OA\.lenght: no such field; bodies\.OA has .*length"),
        ("boddies.OA.length", 1.0, r"boddies\.OA\.length: no such field; the scene has .*bodies"),
        ("bodies.OA.length.x", 1.0, r"bodies\.OA\.length\.x: no such field; bodies\.OA\.length has nothing"),
        ("initial.XY.angle", 1.0, r"initial\.XY\.angle: no such field; initial has OA, AB"),
        ("initial.OA.speed", 1.0, r"initial\.OA\.speed: no such field"),
        (
            "initial.OA.spin.0",
            1.0,
            r"spin\.0: initial\.OA\.spin is not stated, .*; state it whole, such as \[0, 0, 0\]",
        ),
        ("initial.OA.position.1", 1.0, r"initial\.OA\.position is not stated, .*; state it whole$"),
        ("initial.OA.modes.0", 1.0, r"initial\.OA\.modes\.0: no such field; initial\.OA\.modes has nothing below it"),
        ("initial.OA", 1.0, r"initial\.OA"),
        ("solver", 1.0, r"solver"),
        ("", 1.0, r"no such field"),
        (".", 1.0, r"no such field"),
        ("bodies.OA.density", -1.0, r"bodies\.OA\.density: .*greater than 0"),
        ("bodies.OA.density", math.nan, r"bodies\.OA\.density: .*finite"),
        ("initial.OA.angle", 90.0, r"initial\.OA\.angle: .*radians"),
        ("solver.integrator", "euler", r"solver\.integrator: "),
    ],
)
def test_with_values_refuses_unknown_paths_and_bad_values(path: str, value: Any, why: str) -> None:
    with pytest.raises(InputError, match=why) as refusal:
        CABLE_SCENE.with_values({path: value})
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("path", ["bodies.XY.length", "bodies.OA.lenght", "initial.XY.angle", "nothing", ""])
def test_value_refuses_unknown_paths(path: str) -> None:
    with pytest.raises(InputError, match="no such field") as refusal:
        CABLE_SCENE.value(path)
    assert str(refusal.value).startswith(f"{path}: ")


def test_a_twist_that_elements_cannot_tell_is_refused() -> None:
    """Beyond half a turn from end to end: 24 rad need eight elements."""
    strip = load_scene("swinging-strip").with_values({"bodies.strip.twist": [48.0]})
    with pytest.raises(InputError, match=r"bodies.strip.*24 rad within an element.* use at least 8 elements"):
        strip.with_values({"bodies.strip.elements": 1})
    assert strip.with_values({"bodies.strip.elements": 8}).value("bodies.strip.elements") == 8


@pytest.mark.parametrize("letter", ["x", "y", "z"])
def test_a_letter_is_a_unit_axis(letter: str) -> None:
    machine = load_scene("heavy-top").model_dump(mode="json", exclude_unset=True)
    ends = {"first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": next(iter(machine["bodies"]))}}

    def parsed(axis: object) -> Scene:
        return Scene.parse(machine | {"joints": {"J": {"kind": "revolute", "axis": axis} | ends}})

    assert parsed(letter).joints == parsed([float(letter == one) for one in "xyz"]).joints
    with pytest.raises(InputError, match=r"joints.J.axis: an axis has three components, such as \[1, 0, 0\].* 'w'"):
        parsed("w")


@pytest.mark.parametrize(
    ("change", "named", "why"),
    [
        pytest.param(("gravity", 9.81), "gravity", "needs a list, found 9.81", id="one-number"),
        pytest.param(
            ("initial.top.rotation", [1.0, 0.0, 0.0, 0.0]), "initial.top.rotation", "4 entries", id="quaternion"
        ),
        pytest.param(("initial.top.spin", [1.0, 0.0]), "initial.top.spin", "too few numbers", id="two-of-three"),
        pytest.param(
            ("joints.foot.axis", [1, 0]),
            "joints.foot.axis",
            "three components.* `direction`, an angle",
            id="axis-in-the-plane",
        ),
        pytest.param(("bodies.top.inertia", [1.0, 2.0]), "bodies.top.inertia", "three principal moments", id="moments"),
        pytest.param(("bodies.top.inertia", [[1.0], [2.0, 3.0]]), "bodies.top.inertia", "3 x 3 matrix", id="rows"),
        pytest.param(("joints.foot.first.point", [0] * 4), "joints.foot.first.point", "a name, or a list", id="point"),
        pytest.param(("joints.foot.kind", "ball"), "joints.foot", "no kind is called ball; there are", id="kind"),
    ],
)
def test_slips_in_space_are_one_line(change: tuple[str, Any], named: str, why: str) -> None:
    place = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    data: Any = {
        "name": "top",
        "dimensions": 3,
        "bodies": {"top": {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.1, 0.05]}},
        "joints": {"foot": {"kind": "revolute", "first": place, "second": {"body": "top"}, "axis": "z"}},
        "markers": {"top": {"body": "top"}},
        "initial": {"top": {"rotation": [0.0, 0.0, 0.1], "spin": [0.0, 0.0, 1.0]}},
        "solver": {"duration": 1.0},
    }
    Scene.parse(data)
    *parents, leaf = change[0].split(".")
    within = data
    for name in parents:
        within = within[name]
    within[leaf] = change[1]
    with pytest.raises(InputError, match=rf"^my\.yaml: {re.escape(named)}: .*{why}"):
        Scene.parse(data, "my.yaml")
