"""The models of what is done about infinitely many collisions in finite time."""

from collections.abc import Mapping
from typing import Annotated

from pydantic import Discriminator, Field, Tag

from snooker_cli.config import quantities as q
from snooker_cli.config.balls import Model


class ContactDuration(Model):
    """Contacts last: a ball whose last contact was a moment ago collides without loss.

    The TC model of Luding and McNamara, Granular Matter 1, 113 (1998).
    """

    tc: q.Fraction = Field(
        description="How long a contact lasts, in mean free times as they are at present, at most "
        "1: a collision is elastic if a ball in it had another contact more recently."
    )


class ElasticBelow(Model):
    """Slow collisions are elastic."""

    elastic_below: q.Positive = Field(
        description="Relative normal speed, m/s, below which a collision is elastic."
    )


REGULARISED: Mapping[str, type[ContactDuration] | type[ElasticBelow]] = {
    "tc": ContactDuration,
    "elastic_below": ElasticBelow,
}
"""The ways to give it as a mapping, by their key."""

NEEDS = "stop, slide, {tc: NUMBER} or {elastic_below: NUMBER}"


def collapse_variant(value: object) -> str | None:
    """The key in REGULARISED that `collapse:` goes by, "word" for a text; None when unclear."""
    if isinstance(value, str):
        return "word"
    for key, model in REGULARISED.items():
        if isinstance(value, model):
            return key
    given = list(value) if isinstance(value, Mapping) else []
    return given[0] if len(given) == 1 and given[0] in REGULARISED else None


Collapse = Annotated[
    Annotated[q.Collapse, Tag("word")]
    | Annotated[ContactDuration, Tag("tc")]
    | Annotated[ElasticBelow, Tag("elastic_below")],
    Discriminator(
        collapse_variant,
        custom_error_type="needs",
        custom_error_message="{needs} is needed",
        custom_error_context={"needs": NEEDS},
    ),
]
