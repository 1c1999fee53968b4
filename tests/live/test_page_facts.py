"""The page's facts are those of the program, on every type of gas."""

from __future__ import annotations

import pytest
from gas_kinds import KINDS, scene_of
from live_scripts import LiveScripts

from snooker_cli import facts
from snooker_cli.analysis import theories
from snooker_cli.live_page.page import stored_start
from snooker_cli.live_page.page_facts import (
    DRAWN,
    REFERENCES,
    asked_traits,
    camel,
    facts_source,
)


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_knows_what_the_program_knows_of_a_gas(kind: str, javascript: LiveScripts) -> None:
    scene = scene_of(kind)
    traits, holds, applies = javascript.value(
        """(() => {
          const traits = traitsOf(storedScene(scene)), names = Object.keys(FACTS);
          const holds = Object.fromEntries(names.map((name) => [name, FACTS[name](traits)]));
          const theories = Object.keys(NEEDS).map((name) => [name, applies(name, traits)]);
          return [traits, holds, Object.fromEntries(theories)];
        })()""",
        scene=stored_start(scene),
    )
    known = facts.traits_of(scene)
    expected = {camel(name): value for name, value in known._asdict().items()}
    assert traits.keys() == {*asked_traits()}
    for name, value in traits.items():
        is_number = isinstance(value, float | int)
        close = pytest.approx(expected[name], rel=1e-12) if is_number else expected[name]
        assert value == close, name
    assert holds == {name: facts.FACTS[name].holds(known) for name in holds}
    drawn = {name: theories.theory_of(scene, *about) is not None for name, about in DRAWN.items()}
    drawn |= {name: facts.hold(known, *needs) for name, needs in REFERENCES.items()}
    assert applies == drawn


def test_a_fact_that_is_no_expression_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def smooth(gas: facts.Traits) -> bool:
        return not [gas.rough]

    fact = facts.FACTS["smooth"]._replace(holds=smooth)
    monkeypatch.setitem(facts.FACTS, "smooth", fact)
    with pytest.raises(ValueError, match="pages have it in JavaScript too"):
        facts_source()
