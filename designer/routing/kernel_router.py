"""The compiled router: a shortest path on a grid of two layers, and what lies in its way.

A node is a place of the centre line of a track on a layer: ``layer * places + place``. Nets are of
kinds, which have a width and a clearance each. Copper is counted where the centre line of another
net would come too close to it, for each kind by itself (``Grid``), so a path looks at one number a
node. Costs are whole numbers: a board is routed alike on every machine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from designer.base.jit import callee, compiled

Int = NDArray[np.int64]
Small = NDArray[np.int32]
Count = NDArray[np.int16]

STRAIGHT, DIAGONAL = 1000, 1414
"""Cost of a step on the grid."""
BEND = 300
"""Cost of a change of direction."""
UNIT = 16
"""Unit of the factors of layers and of pressure."""
HISTORY = 1024
"""History of a node that doubles its cost."""
BREAK = -1
"""Mark between two paths of a route."""
FREE, NOBODY = 0, -1
"""Owners of a node: any net may pass, none may; else the one net that may."""


class Grid(NamedTuple):
    """What lies where, for K kinds of nets, N places on each of two layers."""

    width: int
    """Places in a row."""
    places: int
    """Places on a layer, N."""
    owner: Count
    """(K, 2 N) the net whose pads alone a track of each kind may pass; FREE, NOBODY."""
    via_owner: Count
    """(K, N) the same of a via."""
    taken: Count
    """(K, 2 N) nets whose copper is too near for a track of each kind."""
    via_taken: Count
    """(K, N) the same for a via."""
    history: Small
    """(2 N,) how often nets have met at a node, in units of HISTORY."""


class Tariff(NamedTuple):
    """What a net pays."""

    net: int
    """Its number, from 1."""
    kind: int
    front: int
    """Factor of a step on the front, in units of UNIT."""
    back: int
    """Factor of a step on the back, in units of UNIT."""
    via: int
    pressure: int
    """Price of each net that is in the way, in units of UNIT."""


class SearchSpace(NamedTuple):
    """Scratch space of a search, for the 2 N nodes."""

    cost: Int
    """(2 N,) least cost to a node."""
    parent: Small
    """(2 N,) the node before it."""
    seen: Small
    """(2 N,) number of the search that wrote these two."""
    goal: Small
    """(2 N,) number of the search that ends here."""
    tree: Small
    """(2 N,) nodes of the net that are reached."""
    keys: Int
    """(8 N,) heap: cost and lower bound of the rest."""
    nodes: Small
    """(8 N,) heap: nodes."""
    searches: Int
    """(1,) number of the last search."""


@callee
def push(work: SearchSpace, size: int, key: int, node: int) -> int:
    """Put a node on the heap; its new size. A full heap takes no more."""
    keys, nodes = work.keys, work.nodes
    if size == len(keys):
        return size
    i = size
    while i > 0:
        above = (i - 1) >> 1
        if keys[above] <= key:
            break
        keys[i], nodes[i] = keys[above], nodes[above]
        i = above
    keys[i], nodes[i] = key, node
    return size + 1


@callee
def pop(work: SearchSpace, size: int) -> int:
    """Take the least off the heap, its node to the place behind the end; the new size."""
    keys, nodes = work.keys, work.nodes
    least, size = nodes[0], size - 1
    key, node = keys[size], nodes[size]
    i = 0
    while True:
        below = 2 * i + 1
        if below >= size:
            break
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[i], nodes[i] = keys[below], nodes[below]
        i = below
    keys[i], nodes[i] = key, node
    nodes[size] = least
    return size


@callee
def price(step: int, history: int, taken: int, pressure: int) -> int:
    """What a step costs that the history and the nets in its way make dearer."""
    return step * (HISTORY + history) // HISTORY * (UNIT + pressure * taken) // UNIT


@callee
def bound(x: int, y: int, box: Int, factor: int) -> int:
    """Least cost from a place to a box (left, top, right, bottom)."""
    across = max(box[0] - x, 0, x - box[2])
    down = max(box[1] - y, 0, y - box[3])
    low, high = min(across, down), max(across, down)
    return int((low * DIAGONAL + (high - low) * STRAIGHT) * factor // UNIT)


@callee
def relax(
    work: SearchSpace, size: int, search: int, node: int, after: int, cost: int, rest: int
) -> int:
    """Take a cheaper way to ``after``; the size of the heap."""
    if work.seen[after] == search and work.cost[after] <= cost:
        return size
    work.seen[after] = search
    work.cost[after] = cost
    work.parent[after] = node
    return push(work, size, cost + rest, after)


@callee
def find(
    grid: Grid, tariff: Tariff, work: SearchSpace, trees: int, box: Int, search: int, plane: bool
) -> int:
    """The node of the goal that the cheapest way from the tree ends at; -1 where there is none.

    plane : whether any via is a goal too.
    """
    width, places = grid.width, grid.places
    owner, taken = grid.owner[tariff.kind], grid.taken[tariff.kind]
    rows = places // width
    least = min(tariff.front, tariff.back)
    size = 0
    for i in range(trees):
        node = work.tree[i]
        place = node % places
        rest = bound(place % width, place // width, box, least)
        size = relax(work, size, search, -1, node, 0, rest)
    while size > 0:
        key = work.keys[0]
        size = pop(work, size)
        node = work.nodes[size]
        layer, place = node // places, node % places
        x, y = place % width, place // width
        if key > work.cost[node] + bound(x, y, box, least):
            continue
        before = work.parent[node]
        came = 0 if before < 0 else node - before
        if work.goal[node] == search or (plane and abs(came) == places):
            return int(node)
        factor = tariff.back if layer else tariff.front
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                if (dx == 0 and dy == 0) or not (0 <= x + dx < width and 0 <= y + dy < rows):
                    continue
                move = dy * width + dx
                after = node + move
                if owner[after] != FREE and owner[after] != tariff.net:
                    continue
                step = (DIAGONAL if dx != 0 and dy != 0 else STRAIGHT) * factor // UNIT
                cost = price(step, grid.history[after], taken[after], tariff.pressure)
                if came != 0 and came != move:
                    cost += BEND
                rest = bound(x + dx, y + dy, box, least)
                size = relax(work, size, search, node, after, work.cost[node] + cost, rest)
        free = grid.via_owner[tariff.kind, place]
        after = place if layer else place + places
        if free != FREE and free != tariff.net:
            continue
        if owner[after] != FREE and owner[after] != tariff.net:
            continue
        met = max(grid.via_taken[tariff.kind, place], taken[after])
        cost = price(tariff.via, grid.history[after], met, tariff.pressure)
        rest = bound(x, y, box, least)
        size = relax(work, size, search, node, after, work.cost[node] + cost, rest)
    return -1


@callee
def nearest(gaps: Int, reached: Count) -> int:
    """The terminal that is nearest to the tree and not reached yet; -1 where all are."""
    best = -1
    for i in range(len(gaps)):
        if reached[i] == 0 and (best < 0 or gaps[i] < gaps[best]):
            best = i
    return best


@callee
def grow(
    grid: Grid, work: SearchSpace, trees: int, node: int, starts: Int, nodes: Small, gaps: Int
) -> int:
    """Add a node to the tree, and see which terminals it is nearer to; the tree's size."""
    width, places = grid.width, grid.places
    place = node % places
    for i in range(len(gaps)):
        first = nodes[starts[i]] % places
        across = abs(first % width - place % width)
        down = abs(first // width - place // width)
        gaps[i] = min(gaps[i], max(across, down) * 2 + min(across, down))
    if trees < len(work.tree):
        work.tree[trees] = node
        trees += 1
    return trees


@compiled
def route(
    grid: Grid, tariff: Tariff, work: SearchSpace, starts: Int, nodes: Small, out: Small
) -> tuple[int, int]:
    """Join the terminals of one net: how much of ``out`` is written, how many stay open.

    starts : (T + 1,), nodes : terminal i has nodes[starts[i]:starts[i + 1]]. out : the paths, each
    a run of nodes from its goal back to the tree, with BREAK after it.
    """
    terminals = len(starts) - 1
    gaps = np.full(terminals, np.int64(1) << 40)
    reached = np.zeros(terminals, dtype=np.int16)
    box = np.zeros(4, dtype=np.int64)
    reached[0] = 1
    trees, size, open_ = 0, 0, 0
    for i in range(starts[0], starts[1]):
        trees = grow(grid, work, trees, nodes[i], starts, nodes, gaps)
    for _ in range(terminals - 1):
        target = nearest(gaps, reached)
        reached[target] = 1
        work.searches[0] += 1
        search = work.searches[0]
        box[:] = grid.places, grid.places, -1, -1
        for i in range(starts[target], starts[target + 1]):
            work.goal[nodes[i]] = search
            place = nodes[i] % grid.places
            x, y = place % grid.width, place // grid.width
            box[0], box[1] = min(box[0], x), min(box[1], y)
            box[2], box[3] = max(box[2], x), max(box[3], y)
        node = find(grid, tariff, work, trees, box, search, False)
        if node < 0:
            open_ += 1
            continue
        while node >= 0:
            out[size] = node
            size += 1
            trees = grow(grid, work, trees, node, starts, nodes, gaps)
            node = work.parent[node]
        out[size] = BREAK
        size += 1
        for i in range(starts[target], starts[target + 1]):
            trees = grow(grid, work, trees, nodes[i], starts, nodes, gaps)
    return size, open_


@compiled
def route_to_plane(
    grid: Grid, tariff: Tariff, work: SearchSpace, starts: Int, nodes: Small, out: Small
) -> tuple[int, int]:
    """Join each terminal of a net to a plane below: by a via, or to copper that has one.

    Arguments and answer as of ``route``.
    """
    terminals = len(starts) - 1
    reached = np.zeros(terminals, dtype=np.int16)
    box = np.zeros(4, dtype=np.int64)
    box[2], box[3] = grid.width - 1, grid.places // grid.width - 1
    size, open_ = 0, 0
    for t in range(terminals):
        work.searches[0] += 1
        search = work.searches[0]
        for i in range(size):
            if out[i] != BREAK:
                work.goal[out[i]] = search
        for i in range(starts[t]):
            work.goal[nodes[i]] = search
        for other in range(t):
            if reached[other] == 0:
                for i in range(starts[other], starts[other + 1]):
                    work.goal[nodes[i]] = 0
        trees = starts[t + 1] - starts[t]
        work.tree[:trees] = nodes[starts[t] : starts[t + 1]]
        node = find(grid, tariff, work, trees, box, search, True)
        reached[t] = node >= 0
        open_ += node < 0
        while node >= 0:
            out[size] = node
            size += 1
            node = work.parent[node]
        if reached[t]:
            out[size] = BREAK
            size += 1
    return size, open_


@callee
def disc(
    taken: Count, marks: Small, mark: int, width: int, place: int, reach: int, sign: int
) -> None:
    """Count a net once at each place of a layer nearer than the root of ``reach`` steps."""
    rows = len(taken) // width
    x, y = place % width, place // width
    most = 0
    while (most + 1) * (most + 1) < reach:
        most += 1
    for dy in range(-most, most + 1):
        if not 0 <= y + dy < rows:
            continue
        for dx in range(-most, most + 1):
            if not 0 <= x + dx < width or dx * dx + dy * dy >= reach:
                continue
            at = (y + dy) * width + x + dx
            if marks[at] != mark:
                marks[at] = mark
                taken[at] += sign


@compiled
def count(
    grid: Grid, paths: Small, reaches: Int, marks: Small, via_marks: Small, mark: int, sign: int
) -> None:
    """Count the copper of a net's paths in, or with sign -1 out, for nets of each kind.

    reaches : (4, K) squares, in steps, of how near the centre line may not come: of its track to a
    track of each kind and to a via, of its via to a track and to a via. mark : a number that
    ``marks`` (K, 2 N) and ``via_marks`` (K, N) do not have.
    """
    places, width = grid.places, grid.width
    for k in range(len(grid.taken)):
        before = np.int64(BREAK)
        for node in paths:
            if node != BREAK:
                layer, place = node // places, node % places
                vias, seen = grid.via_taken[k], via_marks[k]
                via = before != BREAK and before % places == place
                disc(vias, seen, mark, width, place, reaches[3 if via else 1, k], sign)
                for at in range(2):
                    if via or at == layer:
                        taken = grid.taken[k, at * places : (at + 1) * places]
                        on_layer = marks[k, at * places : (at + 1) * places]
                        reach = reaches[2 if via else 0, k]
                        disc(taken, on_layer, mark, width, place, reach, sign)
            before = np.int64(node)


@compiled
def conflicts(grid: Grid, kind: int, paths: Small, history: int) -> int:
    """Nodes of a net's paths that are too near to others; each becomes dearer by ``history``."""
    met, before = 0, np.int64(BREAK)
    for node in paths:
        if node != BREAK:
            place = node % grid.places
            via = before != BREAK and before % grid.places == place
            # The net's own copper counts once.
            if grid.taken[kind, node] > 1 or (via and grid.via_taken[kind, place] > 1):
                met += 1
                grid.history[node] += history
        before = np.int64(node)
    return met
