"""What can be true of a gas: each fact is a function, with a sentence for its absence.

Theories and figures name the facts that they need. Nothing else asks a scene such a question. The
live page has these functions as JavaScript too (``live_page/page_theories.py``). So each function
is a single expression of comparisons, ``and``, ``or``, ``not`` and calls of other facts. Its
docstring says what is true of a gas with it, and stands in docs/extending.md.
"""

import math
from collections.abc import Callable, Iterable
from math import inf
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from snooker_cli import theory
from snooker_cli.config import Config
from snooker_cli.containers import ENDS, Container
from snooker_cli.laws import CollisionRules, Law, PackageLaw, Sides, Thermal
from snooker_cli.scene import Scene
from snooker_cli.theory import DENSEST_FLUID

MOST_SPECIES = 6
"""Number of species that one figure can show."""

MANY_BALLS = 500
"""About 25 cells of 20 balls; a circle contains nine or more whole cells."""

ROUNDING = 1e-12
"""Share of the energy below which a common motion is rounding."""


class Traits(NamedTuple):
    """The numbers and words of a gas that facts ask for.

    number, species, masses : of balls; of their species; of their different masses
    packing : area of the balls over that of the container; nan where only a config is known
    crowding : area of the balls over the most that `theory.fluid_state` can fit; nan likewise
    published : the source of a published pressure at this packing, or an empty text
    title, walls : the container in words; whether balls collide with it
    repeats, keeps_drift : whether it repeats along an axis, and between walls
    across : the direction from wall to wall, or an empty text
    free : whether the container moves
    cor, pair_law : of collisions between balls; the law's word
    wall_cor, wall_law : the least of all walls; the word of their law; 1 and empty without walls
    unbalanced_law : the word of the first law of a wall that `theory.balance_temperature` does not
        know, or an empty text
    hot_laws : number of different laws of walls that give energy
    wall_temperature : that of all walls that change the energy, J; 0 if they have no one
    hot_ends : whether one of the walls at the ends of `across` gives energy, by a law of its own
    unknown_loss : the word of the first law whose losses theory does not know, or an empty text
    rough, tangential_cor, friction : of balls; −1 and 0 of smooth ones
    pairs_keep_slip, wall_keeps_slip : whether contacts along the tangent take no energy
    rubs_wall : whether hits of the wall change spins
    contact_duration, elastic_below : as of ``Scene``
    moves, at_rest : whether a ball moves at the start; whether their centre of mass is at rest
    events, states : whether a run stores all collisions, and states of the balls at some times
    """

    number: int
    species: int
    masses: int
    packing: float
    crowding: float
    published: str
    title: str
    walls: bool
    repeats: bool
    keeps_drift: bool
    across: str
    free: bool
    cor: float
    pair_law: str
    wall_cor: float
    wall_law: str
    unbalanced_law: str
    hot_laws: int
    wall_temperature: float
    hot_ends: bool
    unknown_loss: str
    rough: bool
    tangential_cor: float
    friction: float
    pairs_keep_slip: bool
    wall_keeps_slip: bool
    rubs_wall: bool
    contact_duration: float
    elastic_below: float
    moves: bool
    at_rest: bool
    events: bool
    states: bool


def traits_of(gas: Scene | Config) -> Traits:
    """The traits of a scene, as if a run stored everything that it can store; or of a config."""
    return _of_config(gas) if isinstance(gas, Config) else _of_scene(gas)


def _of_scene(scene: Scene) -> Traits:
    balls = np.column_stack([scene.radii, scene.masses])
    published = theory.published_ratio(scene.packing_fraction)
    return Traits(
        number=scene.number,
        species=1 if scene.equal_balls else len(np.unique(balls, axis=0)),
        masses=1 if scene.equal_balls else len(np.unique(scene.masses)),
        packing=scene.packing_fraction,
        crowding=_crowding(scene.packing_fraction, float(np.mean(scene.radii)), scene.container),
        published=published.source if published else "",
        free=scene.free,
        moves=scene.kinetic_energy > 0,
        at_rest=scene.drift_energy <= ROUNDING * scene.kinetic_energy,
        events=True,
        states=True,
        **traits_of_rules(scene.container, scene.rules),
    )


def _of_config(config: Config) -> Traits:
    """What a config says about its gas: the packing is not known."""
    groups: Any = config.balls
    groups = groups if isinstance(groups, tuple) else getattr(groups, "list", [groups])
    moves = (getattr(group, "speed", 0) or any(getattr(group, "velocity", ())) for group in groups)
    return Traits(
        number=config.number,
        species=len({(group.radius, group.mass) for group in groups}),
        masses=len({group.mass for group in groups}),
        packing=math.nan,
        crowding=math.nan,
        published="",
        free=math.isfinite(config.container.mass),
        moves=any(moves),
        at_rest=bool(config.species and not config.placed),
        events=config.keeps_events,
        states=bool(config.keeps_events or config.stored_times),
        **traits_of_rules(config.container.shape_class, config.collision_rules),
    )


def _crowding(packing: float, radius: float, container: Container) -> float:
    region = container.accessible(radius)
    return packing * container.area / (region.area + region.edge * radius)


def resized(traits: Traits, number: float, radius: float, container: Container) -> Traits:
    """The traits of as many equal balls of another radius (m) in a container of this shape."""
    packing = container.packing_fraction(number * radius**2)
    return traits._replace(packing=packing, crowding=_crowding(packing, radius, container))


def traits_of_rules(
    container: Container | type[Container], rules: CollisionRules
) -> dict[str, Any]:
    """The traits that follow from the container's shape and from what collisions do."""
    pair, wall, surface = rules.pair_law, rules.wall_law, rules.surface
    laws = wall.parts if container.has_wall else ()
    changing = [law for law in laws if law.adds_energy or _cor(law) < 1]
    warm = {law.temperature if isinstance(law, Thermal) else 0.0 for law in changing}
    if surface is not None and not surface.elastic_wall:
        warm = set()
    lossy = (law for law in (pair, *laws) if not (law.adds_energy or theory.has_mean_loss(law)))
    unknown = (law for law in laws if not isinstance(law, theory.BALANCED))
    ends = ENDS.get(container.across or "", ())
    return {
        "title": container.title,
        "walls": container.has_wall,
        "repeats": any(container.periodic),
        "keeps_drift": container.keeps_drift(),
        "across": container.across or "",
        "contact_duration": rules.contact_duration,
        "elastic_below": rules.elastic_below,
        "cor": _cor(pair),
        "pair_law": pair.name,
        "wall_cor": min(map(_cor, wall.parts)) if container.has_wall else 1.0,
        "wall_law": wall.name if container.has_wall else "",
        "unbalanced_law": next((law.name for law in unknown), ""),
        "hot_laws": len({law for law in laws if law.adds_energy}),
        "wall_temperature": warm.pop() if len(warm) == 1 else 0.0,
        "hot_ends": isinstance(wall, Sides) and any(getattr(wall, end).adds_energy for end in ends),
        "unknown_loss": next((law.name for law in lossy), ""),
        "rough": surface is not None,
        "tangential_cor": surface.tangential_cor if surface else -1.0,
        "friction": surface.friction if surface else 0.0,
        "pairs_keep_slip": surface is None or surface.elastic_pairs,
        "wall_keeps_slip": not container.has_wall or surface is None or surface.elastic_wall,
        "rubs_wall": container.has_wall and surface is not None and surface.rubs_wall,
    }


def _cor(law: Law) -> float:
    """The CoR, which is below 1 of a law of a package: it may take energy at some speed."""
    return min(law.cor, BELOW_ONE) if isinstance(law, PackageLaw) else law.cor


BELOW_ONE = math.nextafter(1.0, 0.0)

Holds: TypeAlias = Callable[[Traits], bool]


class Fact(NamedTuple):
    """Something that can be true of a gas.

    name : the name of its function
    absence : why a theory or figure that needs it is missing, without a full stop; traits stand in
        braces
    advice : what to change in a config, if anything
    of_type : whether a gas without it is of another type, which has its own theories and lacks none
    """

    name: str
    holds: Holds
    absence: str
    advice: str = ""
    of_type: bool = False

    def words(self, traits: Traits) -> str:
        """Why a gas without it lacks something."""
        return self.absence.format_map(traits._asdict())

    def reason(self, traits: Traits) -> str:
        """Why a gas without it lacks something, and what to change."""
        return f"{self.words(traits)}; {self.advice}" if self.advice else self.words(traits)


GasType: TypeAlias = Literal["cooling", "elastic", "warm"]

FACTS: dict[str, Fact] = {}
"""Every fact by its name."""


def fact(absence: str, advice: str = "", *, of_type: bool = False) -> Callable[[Holds], Holds]:
    """Puts a function into ``FACTS``."""

    def register(holds: Holds) -> Holds:
        FACTS[holds.__name__] = Fact(holds.__name__, holds, absence, advice, of_type)
        return holds

    return register


def missing(traits: Traits, needs: Iterable[str]) -> Fact | None:
    """The first of these facts that is not true of a gas; ``None`` if all are."""
    return next((FACTS[name] for name in needs if not FACTS[name].holds(traits)), None)


def hold(gas: Traits | Scene | Config, *needs: str) -> bool:
    """Whether all these facts are true of a gas."""
    return missing(gas if isinstance(gas, Traits) else traits_of(gas), needs) is None


def gas_type(traits: Traits) -> GasType:
    """Whether walls give energy to a gas; else whether collisions take some."""
    types: tuple[tuple[GasType, str], ...] = (("warm", "warm_walls"), ("elastic", "elastic"))
    return next((word for word, name in types if hold(traits, name)), "cooling")


# The balls.


@fact("one ball meets no other", "it needs two or more")
def several(gas: Traits) -> bool:
    """Two balls or more."""
    return gas.number > 1


@fact("two balls form no clusters")
def three(gas: Traits) -> bool:
    """Three balls or more."""
    return gas.number > 2


@fact("two balls have one speed")
def three_or_walls(gas: Traits) -> bool:
    """Three balls or more, or walls."""
    return gas.walls or gas.number > 2


@fact("one ball keeps its speed along the walls")
def shared_speed(gas: Traits) -> bool:
    """Two balls or more, or no channel."""
    return gas.number > 1 or not gas.keeps_drift


@fact(f"its cells need {MANY_BALLS} balls or more")
def many(gas: Traits) -> bool:
    """500 balls or more."""
    return gas.number >= MANY_BALLS


@fact("the theory needs equal balls")
def equal_balls(gas: Traits) -> bool:
    """All balls have one radius and one mass."""
    return gas.species == 1


@fact("the balls' masses differ")
def one_mass(gas: Traits) -> bool:
    """All balls have one mass."""
    return gas.masses == 1


@fact("the balls' masses differ")
def one_mass_or_walls(gas: Traits) -> bool:
    """All balls have one mass, or there are walls."""
    return gas.walls or gas.masses == 1


@fact("unequal balls that lose energy have no law of speeds")
def equal_or_elastic(gas: Traits) -> bool:
    """Equal balls, or an `elastic` gas."""
    return equal_balls(gas) or elastic(gas)


@fact("it needs 2 species of balls, not {species}", of_type=True)
def two_species(gas: Traits) -> bool:
    """Two species: balls of one radius and one mass are a species."""
    return gas.species == 2


@fact(f"it needs 2 to {MOST_SPECIES} species of balls, not {{species}}")
def few_species(gas: Traits) -> bool:
    """2 to 6 species."""
    return gas.species > 1 and gas.species <= MOST_SPECIES


@fact(f"it shows {MOST_SPECIES} species at most, not {{species}}")
def not_many_species(gas: Traits) -> bool:
    """6 species at most."""
    return gas.species <= MOST_SPECIES


@fact("the balls fill {packing:.2f} of the area, which is too dense for a fluid")
def fluid(gas: Traits) -> bool:
    """The packing fraction is 0.65 at most."""
    return gas.packing <= DENSEST_FLUID


@fact("the balls leave no room for a fluid between the walls")
def room(gas: Traits) -> bool:
    """Between the walls, the density is one that a fluid can have."""
    return gas.crowding < 1


@fact("no pressure is published at this packing", of_type=True)
def published_1985(gas: Traits) -> bool:
    """Erpenbeck and Luban (1985) published the pressure at this packing."""
    return gas.published == "Erpenbeck & Luban 1985"


@fact("no pressure is published at this packing", of_type=True)
def published_2013(gas: Traits) -> bool:
    """Engel et al. (2013) published the pressure at this packing."""
    return gas.published == "Engel et al. 2013"


@fact("nothing moves at the start, so there is no ratio to it")
def moves(gas: Traits) -> bool:
    """A ball moves at the start."""
    return gas.moves


@fact("the balls' centre of mass moves on for ever")
def at_rest(gas: Traits) -> bool:
    """Walls, or balls whose centre of mass is at rest."""
    return gas.walls or gas.at_rest


# Collisions between balls.


@fact("the theory needs one CoR between balls at all speeds")
def one_cor(gas: Traits) -> bool:
    """Collisions between balls have one CoR at all speeds."""
    return gas.pair_law == "constant"


@fact("the theory needs one CoR at the wall at all speeds")
def one_wall_cor(gas: Traits) -> bool:
    """No walls, or walls with one CoR at all speeds that give no energy."""
    return not gas.walls or gas.wall_law == "constant"


@fact("the theory needs one CoR at all speeds", of_type=True)
def constant_cor(gas: Traits) -> bool:
    """`one_cor` and `one_wall_cor`."""
    return one_cor(gas) and one_wall_cor(gas)


@fact("the CoR is the same at all speeds", of_type=True)
def cor_by_speed(gas: Traits) -> bool:
    """Not `constant_cor`."""
    return not constant_cor(gas)


@fact("no theory has the mean loss of the {unknown_loss} law")
def known_losses(gas: Traits) -> bool:
    """Theory knows the mean loss of each law that takes energy."""
    return gas.unknown_loss == ""


@fact("contacts that take no energy have other losses", "set collapse: stop")
def every_loss(gas: Traits) -> bool:
    """Each contact takes the energy of its law: `collapse` changes no contact."""
    return gas.contact_duration == 0 and gas.elastic_below == 0


@fact("all collisions between balls keep the energy", of_type=True)
def lossy_pairs(gas: Traits) -> bool:
    """Collisions between balls take energy."""
    return not elastic_pairs(gas)


@fact("collisions between balls take energy", of_type=True)
def elastic_pairs(gas: Traits) -> bool:
    """Collisions between balls take no energy, or there is one ball."""
    return gas.number == 1 or (gas.cor == 1 and gas.pairs_keep_slip)


@fact("spins take a part of the energy", "remove tangential_cor")
def smooth(gas: Traits) -> bool:
    """Smooth balls, which do not spin."""
    return not gas.rough


@fact("smooth balls do not spin", "give tangential_cor", of_type=True)
def rough(gas: Traits) -> bool:
    """Rough balls, which spin."""
    return gas.rough


@fact("friction limits what a contact gives to spins")
def no_friction(gas: Traits) -> bool:
    """Rough balls whose friction has no limit."""
    return gas.friction == inf


@fact("balls do not touch each other's spins")
def rubbing_pairs(gas: Traits) -> bool:
    """Rough balls whose tangential CoR with each other is above −1."""
    return gas.tangential_cor > -1


@fact("the theory needs a CoR below 1", of_type=True)
def lossy_cor(gas: Traits) -> bool:
    """The CoR between balls is below 1."""
    return gas.cor < 1


@fact("the theory needs a CoR above 0", of_type=True)
def bouncing(gas: Traits) -> bool:
    """The CoR between balls is above 0."""
    return gas.cor > 0


# What walls do.


@fact("walls change it", "it needs a periodic box", of_type=True)
def no_walls(gas: Traits) -> bool:
    """A container without walls: a periodic box."""
    return not gas.walls


@fact("it shows the gas between walls", "set another container.shape", of_type=True)
def walls(gas: Traits) -> bool:
    """A container with walls."""
    return gas.walls


@fact("walls change it", "it needs a periodic box or a channel")
def repeats(gas: Traits) -> bool:
    """A container that repeats: a periodic box or a channel."""
    return gas.repeats


@fact("only the wall of a circle is at one distance from the centre")
def circle(gas: Traits) -> bool:
    """The container is a circle."""
    return gas.across == "radius"


@fact("only the wall of a circle keeps a rotation", of_type=True)
def keeps_turning(gas: Traits) -> bool:
    """As `circle`: its wall keeps the angular momentum of smooth balls."""
    return gas.across == "radius"


@fact("the wall of a circle keeps the angular momentum")
def no_turning(gas: Traits) -> bool:
    """The container is no circle."""
    return not keeps_turning(gas)


@fact("the balls' centre of mass does not move on", of_type=True)
def drifts(gas: Traits) -> bool:
    """No walls, and balls whose centre of mass moves."""
    return not gas.walls and not gas.at_rest


@fact("containers.py has no `across` of a {title}")
def across(gas: Traits) -> bool:
    """A container with a direction from wall to wall: no periodic box."""
    return gas.across != ""


@fact("there is no theory for N balls in a {title}")
def closed(gas: Traits) -> bool:
    """The container is no channel, along which balls would keep their momentum."""
    return not gas.keeps_drift


@fact("there is no theory for N balls in a {title}")
def no_common_drift(gas: Traits) -> bool:
    """No channel, or walls that give energy."""
    return not gas.keeps_drift or warm_walls(gas)


@fact(
    "walls give energy, so the gas neither cools nor keeps its energy",
    "see `stationary`",
    of_type=True,
)
def cold(gas: Traits) -> bool:
    """No wall gives energy."""
    return not warm_walls(gas)


@fact("it is about walls that give energy", "set wall_speed or wall_temperature", of_type=True)
def warm_walls(gas: Traits) -> bool:
    """Walls give energy."""
    return gas.walls and gas.hot_laws > 0


@fact("no wall drives the balls", "set wall_speed", of_type=True)
def driven(gas: Traits) -> bool:
    """All walls have one wall_speed."""
    return gas.walls and gas.wall_law == "driven"


@fact("the theory needs walls that give energy by one law")
def one_hot_law(gas: Traits) -> bool:
    """All walls that give energy have one law."""
    return gas.hot_laws == 1


@fact("the walls do not have one temperature", of_type=True)
def one_wall_temperature(gas: Traits) -> bool:
    """All walls that change the energy have one temperature."""
    return gas.wall_temperature > 0


@fact("the gas is as warm as its wall", of_type=True)
def no_equilibrium(gas: Traits) -> bool:
    """Not both `one_wall_temperature` and `elastic_pairs`."""
    return not (one_wall_temperature(gas) and elastic_pairs(gas))


@fact("the walls have different laws")
def one_wall_law(gas: Traits) -> bool:
    """The walls have one law, or there are none."""
    return gas.wall_law != "sides"


@fact("the walls have one law", of_type=True)
def different_walls(gas: Traits) -> bool:
    """Single walls have laws of their own."""
    return gas.wall_law == "sides"


@fact("there is no balance of energy with a {unbalanced_law} law of a wall")
def balanced_walls(gas: Traits) -> bool:
    """Theory knows the balance of energy at each wall."""
    return gas.unbalanced_law == ""


@fact("nothing takes the energy that walls give")
def lossy(gas: Traits) -> bool:
    """A CoR is below 1."""
    return gas.cor < 1 or gas.wall_cor < 1


@fact("hits of the wall change spins")
def smooth_wall(gas: Traits) -> bool:
    """No hit of a wall changes spins."""
    return not gas.rubs_wall


@fact("hits of the wall take energy")
def elastic_wall(gas: Traits) -> bool:
    """No walls, or walls that neither take nor give energy."""
    return not gas.walls or (gas.wall_cor == 1 and gas.wall_keeps_slip)


@fact("it needs a box or a channel with a wall_temperature or wall_speed of single walls")
def hot_ends(gas: Traits) -> bool:
    """A wall at an end of a box or a channel gives energy, and has a law of its own."""
    return gas.hot_ends


@fact("the walls keep the gas at one temperature", of_type=True)
def uneven(gas: Traits) -> bool:
    """Warm walls that give the gas another temperature in each place."""
    return no_equilibrium(gas) and (gas.wall_law == "thermal" or gas.hot_ends)


# Energy and momentum of the gas.


@fact("it is about the equilibrium of elastic balls", "run it at cor 1", of_type=True)
def elastic(gas: Traits) -> bool:
    """No contact takes or gives energy."""
    return elastic_pairs(gas) and elastic_wall(gas) and cold(gas)


@fact("nothing decays where all collisions are elastic", "take cor below 1", of_type=True)
def cooling(gas: Traits) -> bool:
    """Contacts take energy, and walls give none."""
    return cold(gas) and not elastic(gas)


@fact("the gas cools", "set wall_speed or wall_temperature, or cor 1", of_type=True)
def steady(gas: Traits) -> bool:
    """Walls give energy, or the gas is `elastic`."""
    return warm_walls(gas) or elastic(gas)


@fact("the container moves", "remove container.mass")
def fixed(gas: Traits) -> bool:
    """The container does not move."""
    return not gas.free


@fact("fixed walls take momentum", "give a circle a finite container.mass")
def keeps_momentum(gas: Traits) -> bool:
    """No walls, or a container that moves."""
    return not gas.walls or gas.free


@fact("the momentum is zero at the start, so it has no ratio to it")
def has_momentum(gas: Traits) -> bool:
    """Walls, or balls whose centre of mass moves."""
    return gas.walls or not gas.at_rest


# What a run stores.


@fact("it needs the balls' states", "run the config with `record: events`")
def events(gas: Traits) -> bool:
    """The run stores all collisions."""
    return gas.events


@fact("it needs the balls' states", "run the config with `record: events` or `snapshots`")
def states(gas: Traits) -> bool:
    """The run stores states of the balls."""
    return gas.states


@fact("a2 of a mixture needs the balls' states", "run it with `record: events` or `snapshots`")
def states_of_mixture(gas: Traits) -> bool:
    """Equal balls, or a run that stores states."""
    return equal_balls(gas) or gas.states


VORTICES = (
    *("cold", "lossy_cor", "several", "three", "equal_balls", "fluid", "one_cor", "one_wall_cor"),
    *("smooth", "moves"),
)
"""What the theory of growing vortices needs, see `theory.critical_length`."""
