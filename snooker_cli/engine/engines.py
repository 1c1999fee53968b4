"""The two engines, each with the arrays of one simulation: all pairs for few balls, else cells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from snooker_cli.engine import allpairs, cells, layout, mesh, outlook, tree
from snooker_cli.engine.endings import CELL_FULL, FULL, NOTHING_LEFT, OUT_OF_MARGIN

if TYPE_CHECKING:
    from snooker_cli.engine.layout import Floats, Indices, Integers, Recorded
    from snooker_cli.engine.sampling import Grid
    from snooker_cli.scene import Scene

REORDERED = 4096
"""Balls from which on those in neighbouring cells are kept near each other in memory."""

REORDER_AFTER = 20
"""Events a ball after which balls are put into the order of their cells again."""

FEW, FEW_IN_FREE, MOST = 45, 150, 400
"""Balls up to which all pairs are faster than cells, times the packing's fourth root; at most."""

BALLS_A_CELL, DILUTE = 1.0, 0.4
"""Balls to a cell in a packed gas, and in a dilute one, there over the cube root of the packing."""

MARGIN = 0.1
"""How far a free container may move until all is predicted again, of a cell's side."""

RENEWAL = 400
"""Crossings that take as long as to predict all again does with few balls."""


class Engine(Protocol):
    """A simulation under way."""

    setup: layout.Setup
    state: Floats
    container: Floats | None
    slides: Integers | None
    labels: Indices
    sums: Floats
    counts: Integers

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""


class AllPairs:
    """Few balls in a circle."""

    def __init__(self, scene: Scene, setup: layout.Setup) -> None:
        self.setup = setup
        self.state = layout.balls_of(scene)
        self.container = layout.container_of(scene)
        self.radii, self.masses = layout.unlike(scene)
        self.agenda = np.full((layout.AGENDA_ROWS, scene.number), math.inf)
        self.slides = layout.slides_of(scene)
        self.labels = np.zeros(0, dtype=np.int32)
        self.links = np.full((layout.LINK_ROWS, scene.number), layout.NOBODY, dtype=np.int64)
        self.links[[layout.COUNT, layout.BOUNCES]] = 0
        self.sums, self.counts = layout.new_sums(scene), layout.new_counts()
        allpairs.prepare(
            self.state, self.container, self.setup, self.radii, self.agenda, self.links
        )

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""
        answer = allpairs.advance(
            self.state,
            self.container,
            self.slides,
            self.setup,
            self.radii,
            self.masses,
            self.agenda,
            self.links,
            self.sums,
            self.counts,
            recorded,
            grid,
            room,
        )
        return int(answer)

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""
        return self.state

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""
        _set_back(self, shift)
        self.agenda -= shift


class InCells:
    """Many balls, or a box."""

    def __init__(self, scene: Scene, setup: layout.Setup) -> None:
        number = scene.number
        self.scene, self.setup = scene, setup
        self._hold(layout.lines(layout.CELL_BALL_ROWS * number).reshape(number, -1).T)
        self.state[: layout.BALL_ROWS] = layout.balls_of(scene)
        self.container = layout.container_of(scene)
        self.slides: Integers | None = None
        self.box = layout.half_sides_of(scene)
        self.period = layout.period_of(scene)
        self.radii, self.masses = layout.unlike(scene)
        self.tags[layout.FORMER] = layout.NOBODY
        self.links = np.zeros((layout.CELL_LINK_ROWS, number), dtype=np.int32, order="F")
        self.mesh = mesh.new_mesh(scene, side_of(scene))
        self.cells = self._new_cells(4)
        self.tree = tree.new_tree(number)
        self.labels = np.zeros(0, dtype=np.int32)  # whose row is whose, once they are re-ordered
        self.margin = self._margin()
        self.sums, self.counts = layout.new_sums(scene), layout.new_counts()
        self.ordered_at = 0
        self.renewed_at = 0.0
        self._fill()

    def advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate at most ``room`` events; why it stopped."""
        if self.scene.number >= REORDERED:
            self._keep_order()
        return self._advance(recorded, grid, room)

    def balls(self) -> Floats:
        """The balls' rows as in ``layout``, in the scene's order."""
        if not len(self.labels):
            return self.state
        ordered = np.empty_like(self.state)
        ordered[:, self.labels] = self.state
        return ordered

    def set_back(self, shift: float) -> None:
        """Set all clocks back by a time, s."""
        _set_back(self, shift)
        self.state[[layout.CONTACT_TIME, layout.CROSSING_TIME]] -= shift
        self.tree.times[:] -= shift  # what is equal stays equal: nodes and children agree
        self.renewed_at -= shift
        if self.margin is not None:
            self.margin.place[outlook.UNTIL] -= shift

    def _advance(self, recorded: Recorded, grid: Grid, room: int) -> int:
        """Simulate, and see to the cells on the way."""
        begun, renewals = self._events, 0
        while True:
            done = self._events - begun
            answer = int(
                cells.advance(
                    self.state,
                    self.container,
                    self.margin,
                    self.box,
                    self.period,
                    self.setup,
                    self.radii,
                    self.masses,
                    self.links,
                    self.tags,
                    self.mesh,
                    self.cells,
                    self.near,
                    self.tree,
                    self.labels,
                    self.sums,
                    self.counts,
                    recorded.after(done),
                    grid,
                    room - done,
                )
            )
            if answer == CELL_FULL:
                self._widen()
                self._fill()
            elif answer == OUT_OF_MARGIN and self.margin is not None:
                self.renewed_at = float(self.margin.place[outlook.UNTIL])
                self.margin = self._margin(self.renewed_at)
                self._fill()
                renewals += 1
                if renewals * (RENEWAL + self.scene.number) >= cells.CROSSINGS_AT_ONCE * room:
                    answer = FULL
            if answer not in (CELL_FULL, OUT_OF_MARGIN):
                idle = answer == FULL and self._events == begun
                return NOTHING_LEFT if idle and self._moves_as_one() else answer

    def _hold(self, state: Floats) -> None:
        """Take on the balls' lines, which are floats and integers in the same memory."""
        self.state = state
        self.tags = state.T.view(np.int32).T

    def _moves_as_one(self) -> bool:
        """Whether no ball of a periodic box, or in a free container, moves relative to anything."""
        velocities = self.state[[layout.U, layout.V]]
        if self.container is not None:
            velocities = np.column_stack([velocities, self.container[[layout.U, layout.V]]])
        endless = self.period is not None or self.container is not None
        return endless and not np.ptp(velocities, axis=1).any()

    def _fill(self) -> None:
        """Put the balls into cells and have everything predicted.

        As of the last event; or as of when cells were put round a free container's place since:
        before that it was elsewhere.
        """
        now = max(float(self.sums[layout.NOW]), self.renewed_at)
        if self.margin is not None:
            self.margin.brinks[0] = 0
        self.links[layout.BRINK] = 0
        while True:
            filled = cells.fill(
                now,
                self.state,
                self.period,
                self.links,
                self.tags,
                self.mesh,
                self.cells,
                self.tree,
            )
            if filled:
                self.near = np.zeros(9 * self.cells.members.shape[1] + 4, dtype=np.uint32)
                return
            self._widen()

    def _widen(self) -> None:
        """Give every cell twice the room."""
        self.cells = self._new_cells(2 * self.cells.members.shape[1])

    def _new_cells(self, capacity: int) -> mesh.Cells:
        margin = 0.0 if self.container is None else MARGIN * self.mesh.width
        return mesh.new_cells(self.scene, self.mesh, capacity, margin)

    def _margin(self, now: float = 0.0) -> outlook.Margin | None:
        """Put cells round a free container; where it may be, from ``now`` (s) on, in them."""
        if self.container is None:
            return None
        margin = outlook.new_margin(
            self.container, MARGIN * self.mesh.width, now, self.scene.number
        )
        self.mesh = mesh.centred(self.mesh, *margin.place[: outlook.WIDTH])
        return margin

    @property
    def _events(self) -> int:
        return int(self.counts[layout.WALL_EVENTS] + self.counts[layout.PAIR_EVENTS])

    def _keep_order(self) -> None:
        """Put the balls into the order of their cells, if there have been events enough."""
        if len(self.labels) and self._events < self.ordered_at + (
            REORDER_AFTER * self.scene.number
        ):
            return
        order = np.argsort(self.links[layout.CELL], kind="stable")
        place = np.empty(len(order), dtype=np.int32)
        place[order] = np.arange(len(order), dtype=np.int32)
        labels = self.labels if len(self.labels) else np.arange(len(order), dtype=np.int32)
        self.labels = np.ascontiguousarray(labels[order])
        state = layout.lines(self.state.size).reshape(len(order), -1)
        np.take(self.state.T, order, axis=0, out=state)
        self._hold(state.T)
        self.links = np.asfortranarray(self.links[:, order])
        last = self.tags[layout.FORMER]
        last[last >= 0] = place[last[last >= 0]]
        self.radii = None if self.radii is None else self.radii[order]
        self.masses = None if self.masses is None else self.masses[order]
        self.ordered_at = self._events
        self._fill()


def _set_back(engine: Engine, shift: float) -> None:
    """Set back the clocks that both engines have, and the time until which they simulate."""
    engine.setup = engine.setup._replace(time_limit=engine.setup.time_limit - shift)
    engine.state[layout.CLOCK] -= shift
    engine.sums[layout.NOW] -= shift
    if engine.container is not None:
        engine.container[layout.CLOCK] -= shift


def engine_for(scene: Scene, kind: str | None = None) -> type[AllPairs] | type[InCells]:
    """What suits a scene, or what it is told to be: "allpairs" or "cells".

    Balls that slide are for all pairs, however many they are.

    Raises ``ValueError`` for all pairs in a box, for balls that slide in cells, and for balls that
    slide where there is no fixed circle.
    """
    if scene.slides and (scene.shape != "circle" or scene.free):
        raise ValueError("balls slide along the fixed wall of a circle only: set collapse: stop")
    if scene.slides and kind == "cells":
        raise ValueError("the engine cells lets no ball slide: use allpairs")
    if kind == "allpairs" and scene.shape != "circle":
        raise ValueError(f"the engine allpairs knows no {scene.shape}: use cells")
    if kind is None:
        few = scene.number <= few_at(scene.packing_fraction, free=scene.free)
        kind = "allpairs" if scene.slides or (few and scene.shape == "circle") else "cells"
    return AllPairs if kind == "allpairs" else InCells


def few_at(packing_fraction: float, *, free: bool) -> int:
    """How many balls in a circle all pairs are faster for than cells, by measurement.

    A dilute gas has more crossings of cells, and a free container moves all walls at each hit.
    """
    # Of square roots, which are exactly rounded: a scene gets the same engine on every machine.
    root = math.sqrt(math.sqrt(packing_fraction))
    return int(min((FEW_IN_FREE if free else FEW) / root, MOST))


def side_of(scene: Scene) -> float:
    """Side of the cells, m: wide enough that crossings are no more than looking at partners.

    With n balls to an area and a mean free path l, crossings cost as l / side and partners as
    n side^2: the least is where n side^2 goes as (n l^3)^(1/3) or, in diameters, as the packing's
    cube root to -1.
    """
    balls = max(BALLS_A_CELL, DILUTE * scene.packing_fraction ** (-1 / 3))
    return math.sqrt(balls * scene.area / scene.number)
