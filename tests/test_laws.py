"""Laws of collision: what a hit does, and how files, verification and theories know them."""

from __future__ import annotations

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from config_texts import config
from hostile import with_traces
from pydantic.dataclasses import dataclass
from scenes import gas, scene_of

import snooker_cli
from snooker_cli import laws, store
from snooker_cli.analysis import quantities, theories
from snooker_cli.engine import collision, jit, restitution
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine import package_laws as laws_in_kernels
from snooker_cli.engine.conversion import new_states
from snooker_cli.engine.kernel_state import Setup
from snooker_cli.engine.package_laws import package_laws
from snooker_cli.engine.restitution import WALL, kick, law_rows, laws_of_rows
from snooker_cli.errors import SceneError, StoreError
from snooker_cli.laws import (
    CollisionRules,
    Constant,
    Driven,
    Law,
    PackageLaw,
    Sides,
    Surface,
    Thermal,
    Viscoelastic,
)
from snooker_cli.plugins import Origin, Plugin
from snooker_cli.ranges import STRICT, LawSpeed, Restitution
from snooker_cli.runs import RunFolder, open_run
from snooker_cli.runs.run import RepeatState
from snooker_cli.runs.verification import verify
from snooker_cli.theory import mean_loss


@dataclass(frozen=True, config=STRICT)
class Damped(Law):
    """A further law, which the engine does not know: files and theories do not need to."""

    name = "damped"

    cor: Restitution


WARM = """\
container: {shape: box, width: 20}
balls: {count: 30, radius: 0.5, speed: 5}
cor: 0.9
wall_speed: {left: 1}
wall_temperature: {right: 80}
collisions: 300
repeats: 3
"""


@pytest.fixture
def damped(monkeypatch: pytest.MonkeyPatch) -> Damped:
    """That law, with a word in files."""
    monkeypatch.setitem(laws.LAWS, "damped", Damped)
    return Damped(0.5)


@jit.kernel
def kicked(setup, normal, length):
    return kick(WALL, normal, length, False, setup)


def setup_with(law: Law) -> Setup:
    """What collisions do where the wall has a law."""
    rows = laws_of_rows(Constant(1.0), law)
    return Setup(law_rows(rows), 0.0, 0.0, False, package_laws(rows, len(rows)), 1.0)


KICKS = [  # law, normal speed over a length, length, change
    (Constant(0.5), 3.0, 2.0, 4.5),
    (Viscoelastic(0.6, 16.0), 1.0, 1.0, 1.95),  # (1/16)^(3/4) = 1/8
    (Viscoelastic(0.6, 16.0), 0.5, 2.0, 0.975),
    (Viscoelastic(0.6, 16.0), 16.0, 1.0, 25.6),
    (Viscoelastic(0.6, 16.0), 100.0, 1.0, 160.0),
    (Viscoelastic(0.6, 16.0), -1.0, 1.0, -1.95),
    (Driven(0.5, 3.0), 2.0, 1.0, 7.5),
    (Driven(0.5, 3.0), 1.0, 2.0, 3.75),
    (Driven(0.5, 3.0), 0.0, 1.0, 4.5),
]


@pytest.mark.parametrize(("law", "normal", "length", "change"), KICKS)
def test_kicks_of_other_laws(law, normal, length, change) -> None:
    """Compiled and in plain Python."""
    setup = setup_with(law)
    assert kicked(setup, normal, length) == pytest.approx(change, rel=1e-15)
    assert kicked(setup, normal, length) == kick(WALL, normal, length, False, setup)


def test_the_engine_has_each_law() -> None:
    assert list(restitution.KINDS) == list(laws.LAWS)
    for law in laws.LAWS.values():
        numbers = [0.5 + k for k, _ in enumerate(law.numbers())]
        kind, cor, *others = setup_with(law(*numbers)).laws[WALL]
        assert kind == restitution.KINDS[law.name]
        assert [*others] == (numbers[-1:] if law.numbers()[-1] != "cor" else [0.0])
        assert cor == (0.5 if "cor" in law.numbers() else 0.0)


HALF = 0.5


def with_all_that_keeps_the_bits(speed: float, cor: float, limit: float) -> float:
    """What docs/extending.md says of `restitution`."""
    share = 0.25 if (0.1 < speed <= limit and not cor > HALF) or speed == 3 else 1.0
    for k in range(4):
        share = share / (1 + k * abs(limit - speed) % 1)
    while share > HALF:
        share /= 1 + speed // 2 + HALF
    if speed < 1:
        share = min(share, math.sqrt(speed))
    elif speed > limit:
        share = max(share, math.floor(limit) / 100)
    return max(0.0, min(share, 1.0))


def with_a_power(speed: float, cor: float, limit: float) -> float:
    return cor + (1 - cor) / (1 + (speed / limit) ** 0.25)


def with_an_exponential(speed: float, cor: float, limit: float) -> float:
    return cor + (1 - cor) * math.exp(-speed / limit)


def with_another_function(speed: float, cor: float, limit: float) -> float:
    return close(speed, limit) * cor


def close(a: float, b: float) -> float:
    return 1.0 if a < b else 0.5


def with_a_list(speed: float, cor: float, limit: float) -> float:
    return [cor, 0.5][0] if speed < limit else 1.0


@pytest.fixture
def of_package(monkeypatch: pytest.MonkeyPatch):
    """Makes a law of an installed package of a function."""

    def made(function) -> PackageLaw:
        name = function.__name__
        members = {
            "__annotations__": {"cor": Restitution, "limit": LawSpeed},
            "name": name,
            "restitution": staticmethod(function),
        }
        found = laws.law(type("OfPackage", (PackageLaw,), members))
        entry = Plugin("snooker.laws", name, Origin("package", "1", "0" * 64), found, name)
        monkeypatch.setitem(vars(laws.EVERY_LAW), "plugins", (entry,))
        return found(0.3, 2.0)

    return made


@pytest.mark.parametrize(
    ("function", "foreign"),
    [
        (with_all_that_keeps_the_bits, set()),
        (with_a_power, {"llvm.pow.f64"}),
        (with_an_exponential, {"llvm.exp.f64"}),
    ],
)
def test_a_law_of_a_package_can_use_these(function, foreign, of_package) -> None:
    """Functions of a library of the machine can have other last bits on another one."""
    setup = setup_with(of_package(function))
    for speed in (0.05, 0.5, 1.7, 2.0, 3.0, 1e3):
        assert kicked(setup, speed, 1.0) == kick(WALL, speed, 1.0, False, setup)
    code, _ = jit.code_of(kicked, setup, 1.0, 1.0)
    called = set(re.findall(r"^declare [^@]*@([\w.]+)", code, re.MULTILINE))
    assert {name for name in called if not name.startswith("numba_")} - EXACT == foreign


EXACT = {"llvm.fabs.f64", "llvm.floor.f64", "floor", "sqrt"}
"""What each processor rounds alike."""


@pytest.mark.parametrize("function", [with_another_function, with_a_list])
def test_a_law_of_a_package_cannot_use_these(function, of_package) -> None:
    """The error names the law, not a bug of snooker."""
    words = rf"the law {function.__name__} of package cannot be compiled \(.+, line \d+\); use what"
    with pytest.raises(SceneError, match=words):
        setup_with(of_package(function))


def with_a_stored_kernel(speed: float, cor: float, limit: float) -> float:
    return cor if speed > limit else 1.0


def test_a_stored_kernel_has_the_class_of_its_laws(of_package) -> None:
    """A process may load kernels before it has a scene with the law."""
    of_laws = laws_in_kernels.identity_of([of_package(with_a_stored_kernel)])
    asked_before = getattr(laws_in_kernels, f"PackageLaws_{laws_in_kernels.hash_of(of_laws)}")
    assert laws_in_kernels.class_of(of_laws) is asked_before
    numbers = asked_before(np.array([[0.3, 2.0, 0.0, 0.0]]))
    kind = float(laws_in_kernels.FIRST_KIND)
    assert [numbers.restitution(kind, 0, speed) for speed in (1.0, 3.0)] == [1.0, 0.3]


RULES_AS_JSON = [
    CollisionRules(Constant(0.5), Thermal(80.0)),
    CollisionRules(
        Viscoelastic(0.5, 2.0),
        Sides(Driven(0.9, 1.0), Thermal(80.0), Constant(0.9), Viscoelastic(0.9, 1.0)),
        contact_duration=0.01,
        surface=Surface(0.5, 0.1, math.inf, -1.0, 0.3),
    ),
]


@pytest.mark.parametrize("rules", RULES_AS_JSON)
def test_rules_are_the_same_after_json(rules) -> None:
    assert laws.RULES.validate_json(laws.RULES.dump_json(rules)) == rules


@pytest.mark.parametrize(
    ("where", "value"),
    [
        ("pair_law", {"name": "thermal", "temperature": 1.0}),  # adds energy
        ("pair_law", {"name": "constant", "cor": 1.5}),
        ("pair_law", {"name": "constant", "cor": "0.5"}),
        ("pair_law", {"name": "constant"}),
        ("pair_law", {"name": "constant", "cor": 0.5, "cor_speed": 1.0}),
        ("wall_law", {"name": "driven", "cor": 0.5, "speed": 0.0}),
        ("wall_law", {"name": "unknown", "cor": 0.5}),
        ("wall_law", {"name": "sides", "left": {"name": "constant", "cor": 0.5}}),
        ("contact_duration", 1.5),
        ("slides", 1),
        ("surface", {"inertia": 0.5}),
        ("more", 1.0),
    ],
)
def test_json_of_no_rules_is_refused(where, value) -> None:
    written = laws.RULES.dump_python(RULES_AS_JSON[0], mode="json") | {where: value}
    with pytest.raises(ValueError, match="validation error"):
        laws.RULES.validate_json(json.dumps(written))


def test_a_theory_refuses_a_law_that_it_does_not_know(damped) -> None:
    with pytest.raises(ValueError, match="no theory has the mean loss of the damped law"):
        mean_loss(damped, 1.0)


def test_the_engine_refuses_a_law_that_it_does_not_know(damped) -> None:
    with pytest.raises(ValueError, match=r"no damped law.*engine/restitution\.py"):
        law_rows([damped])


def test_the_keys_of_a_config_choose_the_law() -> None:
    assert laws.law_of_pairs(0.5, 2.0) == Viscoelastic(0.5, 2.0)
    still = config(WARM, "wall_speed=0", "wall_temperature=null")
    assert still.collision_rules.wall_law == Constant(0.9)
    assert config(WARM).collision_rules.wall_law == Sides(
        Driven(0.9, 1.0), Thermal(80.0), Constant(0.9), Constant(0.9)
    )


def test_a_warm_run_is_stored_and_verified(tmp_path: Path) -> None:
    """Two batches, each repeat with a key of its own, which a longer run keeps."""
    data = tmp_path / "warm.yaml"
    data.write_text(WARM)
    run = snooker_cli.run(data, out=tmp_path / "warm", progress=False)
    assert {status.state for status in verify(run, replay=True, workers=1)} == {RepeatState.DONE}
    traces = [trace for trace, _ in store.read(run.batches(0)[0])]
    assert len({trace.start.wall_key for trace in traces}) == 3
    assert traces[0].start.wall_law == config(WARM).collision_rules.wall_law
    longer = snooker_cli.run(data, {"collisions": 500}, out=tmp_path / "warm", progress=False)
    for before, (after, _) in zip(traces, store.read(longer.batches(0)[0]), strict=True):
        assert after.start.wall_key == before.start.wall_key
        assert np.array_equal(after.events.time[:300], before.events.time)


WRONG = [
    {"wall_law": Thermal(20.0)},  # without a key
]


@pytest.mark.parametrize("changes", WRONG)
def test_a_file_with_a_law_that_no_config_gives_is_refused(changes, copy: RunFolder) -> None:
    path = copy.batches(0)[0]
    with_traces(
        lambda trace: replace(
            trace, start=replace(trace.start, **changes), finish=replace(trace.finish, **changes)
        )
    )(path)
    with pytest.raises(StoreError):
        store.read(path)


def test_each_place_of_contact_has_its_law() -> None:
    """One ball hits another at 6 m/s and then the wall at 4.5 m/s."""
    scene = scene_of([(-2.0, 0.0, 6.0, 0.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0, 1.0, 1.0)])
    state = ks.state_of(new_states([replace(scene, pair_law=Viscoelastic(0.5, 6.0))]), 0)
    impulse = collision.collide(0, 1, 0.0, state)
    assert impulse == pytest.approx(4.5, rel=1e-14)
    assert state.balls[ks.U] == pytest.approx([1.5, 4.5], rel=1e-14)
    hit = collision.collide(1, ks.NO_PARTNER, 9.0 / 4.5, state)
    assert hit == pytest.approx(9.0, rel=1e-14)


@pytest.fixture
def copy(finished_run: RunFolder, tmp_path: Path) -> RunFolder:
    """A run that a test can change."""
    shutil.copytree(finished_run.directory, tmp_path / "small")
    return open_run(tmp_path / "small")


def test_a_file_keeps_the_law(copy: RunFolder, damped: Damped) -> None:
    """Also at the wall; another law has another hash, and the same law that of earlier files."""
    path = copy.batches(0)[0]
    hashes = [header.fingerprint for header in store.check(path)]
    with_traces(lambda trace: trace)(path)
    assert [header.fingerprint for header in store.check(path)] == hashes
    for name in ("pair_law", "wall_law"):

        def changed(scene, name=name):
            return replace(scene, **{name: damped})

        with_traces(
            lambda trace, changed=changed: replace(
                trace, start=changed(trace.start), finish=changed(trace.finish)
            )
        )(path)
        for trace, header in store.read(path):
            assert type(getattr(trace.start, name)) is Damped
            assert getattr(trace.start, name) == damped
            assert header.fingerprint not in hashes


def test_verification_finds_a_file_of_other_rules(copy: RunFolder) -> None:
    """Though its hashes are right, and its config is that of the run."""
    changes = {"elastic_below": 0.5}
    assert {status.state for status in verify(copy, replay=False, workers=1)} == {RepeatState.DONE}
    with_traces(
        lambda trace: replace(
            trace, start=replace(trace.start, **changes), finish=replace(trace.finish, **changes)
        )
    )(copy.batches(0)[0])
    status = next(verify(copy, replay=False, workers=1))
    assert status.state is RepeatState.UNUSABLE
    assert "than the config's" in str(status.error)


def test_theories_of_cooling_need_a_constant_law(damped: Damped) -> None:
    scene = gas("circle", 19, 0.2, cor=0.9)
    for law, known in ((Constant(0.9), True), (damped, False)):
        changed = replace(scene, pair_law=law)
        critical = quantities.CRITICAL_RATIO, theories.CRITICAL
        assert (theories.value_of(changed, *critical) is not None) == known
        names = [*theories.speed_laws(changed)]
        assert ("homogeneous cooling, a2" in names) == known
