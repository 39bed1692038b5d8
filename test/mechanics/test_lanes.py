"""Lanes cover what can be reached of an area, clear of its edge and its holes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from climber_uk.mechanics import lanes as lanes_module
from climber_uk.mechanics.area import Area, read_area
from climber_uk.mechanics.fastest_law import Tabulated
from climber_uk.mechanics.lanes import Lanes, joined, lanes_of
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import begun_near
from climber_uk.mechanics.waypoints import Polyline

FACADE = Path(__file__).parents[2] / "config" / "facade.csv"
TOLERANCE, STEP = 0.004, 0.02  # [m] of the path, and of the raster
WINDOWS = "1 .6\n1.5 .6\n1.5 1.4\n1 1.4\n\n2.5 .6\n3 .6\n3 1.4\n2.5 1.4"
HOLE = "0.9 0.9\n1.3 0.7\n1.5 1.2\n1 1.3"
# whose passages above and below a hole are too narrow
PARTED = "0 0\n4 0\n4 1\n2.1 1\n2.1 0.9\n1.9 0.9\n1.9 1\n0 1\n\n1.8 0.3\n2.2 0.3\n2.2 0.6\n1.8 0.6"
AREAS = {
    "a facade with a window": FACADE.read_text(),
    "a hole in a corner": "0 0\n2 0\n2 2\n0 2\n\n0.1 0.1\n0.6 0.1\n0.6 0.6\n0.1 0.6",
    "notched, with a hole": f"0 0\n4 0\n4.5 2\n2 1.4\n2.2 3\n0 3\n\n{HOLE}",
    "clockwise": "0;0\n0;1\n1,5;1\n1,5;0",
    "an L": "0 0\n2 0\n2 1\n1 1\n1 2\n0 2",
    "two windows": f"0 0\n4 0\n4 2\n0 2\n\n{WINDOWS}",
    "round": "\n".join(f"{np.cos(a)} {np.sin(a)}" for a in np.arange(0, 6.28, 0.4)),
    "a strip": "0 0\n3 0\n3 0.45\n0 0.45",
}

TELLING = "a facade with a window", "notched, with a hole", "clockwise", "round"


def made(folder, text, **parameters):
    file = folder / "area.txt"
    file.write_text(text)
    return Lanes(area=str(file), tolerance=TOLERANCE, **parameters)


def nearest_turns(way):
    """Least distance [m] along a way from one turn to the next."""
    legs = np.diff(way, axis=0)
    legs = legs[np.hypot(*legs.T) > TOLERANCE / 6]  # nearer places are one
    bends = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(*legs.T[::-1])))))
    along = np.cumsum(np.hypot(*legs.T))[:-1]
    return np.diff(along[bends > 0.2]).min(initial=np.inf)


def distance(points, area):
    """Distances (n,) [m] of points from the edges of an area, by dense points on these."""
    begin, end = (ends[:, None] for ends in area.edges)
    on_edges = (begin + np.linspace(0, 1, 2001)[:, None] * (end - begin)).reshape(-1, 2)
    return cKDTree(on_edges).query(points)[0]


def is_inside(points, area):
    """Whether points (n, 2) are in the area, by the winding of each ring around them."""
    inside = np.zeros(len(points), bool)
    for ring in area.rings:
        a = np.arctan2(*np.moveaxis(ring[None] - points[:, None], -1, 0)[::-1])
        turns = np.diff(np.unwrap(np.c_[a, a[:, :1]], axis=1)[:, [0, -1]], axis=1)[:, 0]
        inside ^= np.abs(turns) > np.pi
    return inside


def covered(area, way, width):
    """Share of a raster that is covered, of all within half a width of where the centre may be."""
    corners = np.concatenate(area.rings)
    x, y = (
        np.arange(low, high, STEP) + STEP / 2
        for low, high in zip(corners.min(axis=0), corners.max(axis=0), strict=True)
    )
    raster = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    may_be = is_inside(raster, area) & (distance(raster, area) >= area.clearance)
    reachable = cKDTree(raster[may_be]).query(raster)[0] <= width / 2
    driven = cKDTree(way).query(raster)[0] <= width / 2
    return (reachable & driven).sum() / reachable.sum()


@pytest.mark.parametrize(
    ("text", "direction"),
    [
        *(
            pytest.param(text, 0.5, marks=() if name in TELLING else pytest.mark.soak)
            for name, text in AREAS.items()
        ),
        pytest.param(FACADE.read_text(), 0.0, marks=pytest.mark.soak),
        (AREAS["an L"], np.pi / 2),
    ],
    ids=[*AREAS, "across the facade", "up the L"],
)
def test_lanes_cover_what_can_be_reached_and_keep_clear(text, direction, tmp_path):
    lanes = made(tmp_path, text, direction=direction)
    path = Trajectory(lanes, RestToRest(rate=0.2)).path(20_001)[:, :2]
    area = read_area(lanes.area, lanes.clearance)
    assert is_inside(path, area).all()
    assert distance(path, area).min() >= lanes.clearance - 1e-4
    assert covered(area, path, lanes.width) >= 0.99
    assert nearest_turns(lanes.given()) >= lanes.width / 4


def some_area(random):
    """Corners of a rectangle, a polygon, an L, or a rectangle with a square or a polygon in it."""
    kind, (w, h) = random.integers(5), random.uniform(1, 4, 2)
    if kind == 1:
        number = random.integers(4, 9)
        angles = 2 * np.pi / number * (np.arange(number) + random.uniform(0, 0.8, number))
        return [np.c_[np.cos(angles), np.sin(angles)] * random.uniform(1, 2, (number, 1))]
    if kind == 2:
        u, v = random.uniform(0.4, 0.8, 2) * (w, h)
        return [[(0, 0), (w, 0), (w, v), (u, v), (u, h), (0, h)]]
    if kind > 2:
        w, h = w + 2, h + 2
    rings = [np.array([(0, 0), (w, 0), (w, h), (0, h)])]
    if kind == 3:
        x, y = random.uniform(0.7, w - 1.7), random.uniform(0.7, h - 1.7)
        rings.append(np.array([(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]))
    if kind == 4:
        number, turn = random.integers(3, 7), random.uniform(0, 6)
        angles = 2 * np.pi * np.arange(number) / number + turn
        radius = random.uniform(0.2, min(w, h) / 2 - 0.6)
        rings.append((w / 2, h / 2) + radius * np.c_[np.cos(angles), np.sin(angles)])
    return rings


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(3, 100))]
)
def test_of_any_area_the_lanes_cover_it_keep_clear_and_have_no_zigzag(seed, tmp_path):
    random = np.random.default_rng(seed)
    rings = some_area(random)
    text = "\n\n".join("\n".join(f"{x} {y}" for x, y in ring) for ring in rings)
    width, overlap = random.choice([0.15, 0.2, 0.3]), random.choice([0.0, 0.05])
    direction = random.choice([0.0, np.pi / 2, random.uniform(-3, 3)])
    lanes = made(tmp_path, text, width=width, overlap=overlap, direction=direction)
    # what is kept clear of, so that corners that are rounded do as well: a raster's row beyond
    # may be 1 % of a small area
    path, area = Polyline.through(lanes.given(), lanes), read_area(lanes.area, 0.2 + TOLERANCE / 4)
    places = path.derivatives(np.linspace(0, path.length, 10_001))[0]
    assert distance(places[::3], area).min() >= lanes.clearance - 1e-4
    assert covered(area, places, width) >= 0.99
    assert nearest_turns(lanes.given()) >= (width - overlap) / 4


def test_lanes_beside_a_hole_lie_on_those_along_its_edges(tmp_path):
    """Or it would go to and fro between the two."""
    lanes = made(tmp_path, FACADE.read_text())
    area = read_area(lanes.area, 0.2 + TOLERANCE / 4)
    found = lanes_of(area, 0.2, edges=True)
    heights = np.unique(found[found[:, 0, 1] == found[:, 1, 1], 0, 1].round(5))
    assert {0.201, 0.399, 1.601, 1.799} < set(heights.round(3))
    assert np.diff(heights).min() > 0.15


def test_without_lanes_along_edges_it_is_shorter_and_leaves_their_ends(tmp_path):
    with_edges, without = (
        Trajectory(made(tmp_path, AREAS["an L"], edges=edges), RestToRest(rate=0.2))
        for edges in (True, False)
    )
    assert without.course.length < with_edges.course.length
    area = read_area(without.shape.area, 0.2)
    assert covered(area, without.path(20_001)[:, :2], 0.2) > 0.9


def test_lanes_are_straight_evenly_apart_and_no_further_than_asked(tmp_path):
    lanes = made(tmp_path, "0 0\n3 0\n3 1.41\n0 1.41", edges=False, overlap=0.05)
    area = read_area(lanes.area, 0.204)
    found = lanes_of(area, 0.15, edges=False)
    heights = found[:, :, 1]
    np.testing.assert_array_equal(heights[:, 0], heights[:, 1])
    apart = np.diff(heights[:, 0])
    np.testing.assert_allclose(apart, apart[0])
    assert 0.1 < apart[0] <= 0.15
    np.testing.assert_allclose(found[:, :, 0], [[0.204, 2.796]] * len(found), atol=1e-6)


def test_it_begins_at_the_corner_that_is_nearest(tmp_path):
    for x, y in ((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)):
        lanes = made(tmp_path, AREAS["a facade with a window"], start_x=x, start_y=y)
        assert np.hypot(*(lanes.given()[0] - [x, y])) <= 0.3


def test_it_begins_nearest_to_the_climber_unless_it_is_told_where(tmp_path):
    lanes = made(tmp_path, AREAS["a strip"])
    origin = np.array([1.0, 2.0])
    path = Trajectory(lanes, RestToRest(rate=0.2), origin=tuple(origin))
    for corner in ([3.0, 0.0], [3.0, 0.45], [0.0, 0.45], [0.0, 0.0]):
        begin = begun_near(path, origin + corner).at(0.0).pose[:2]
        assert np.hypot(*(begin - origin - corner)) <= 0.3
    assert begun_near(path, origin) is path
    told = replace(path, shape=replace(lanes, start_x=3.0))
    assert begun_near(told, origin) is told
    length = lanes.at_rate(0.0).length
    table = np.concatenate([np.zeros(6), np.linspace(0.0, length), np.full(6, length)])
    of_one_path = replace(path, law=Tabulated(1.0, table))
    assert begun_near(of_one_path, origin + np.array([3.0, 0.0])) is of_one_path


def test_where_the_way_down_counts_more_it_goes_up_from_lane_to_lane(tmp_path):
    """No turn from down to level is left, in which a climber whose turns scrub would sag."""
    descended = []
    for direction in (0.0, np.pi):
        lanes = made(tmp_path, FACADE.read_text(), direction=direction, descent=4.0)
        legs = np.diff(lanes.given(), axis=0)
        legs = legs[np.hypot(*legs.T) > 1e-3]
        slope = legs[:, 1] / np.hypot(*legs.T)
        turns = np.abs(np.sum(legs[1:] * legs[:-1], axis=1)) < 0.1 * np.prod(
            np.hypot(*np.stack([legs[1:], legs[:-1]]).T), axis=1
        )
        descended.append(np.sum((slope[:-1] < -0.9) & (np.abs(slope[1:]) < 0.1) & turns))
    assert descended == [0, 0]


def test_every_lane_is_driven_whole_from_end_to_end():
    area = Area((np.array([[0, 0], [3, 0], [3, 2], [0, 2.0]]),), 0.2)
    lanes = lanes_of(area, 0.2, edges=True)
    way, _ = joined(area, lanes, np.zeros(2))
    steps = {tuple(map(tuple, pair)) for pair in np.stack([way[:-1], way[1:]], axis=1).round(9)}
    for first, last in lanes.round(9).tolist():
        assert {(tuple(first), tuple(last)), (tuple(last), tuple(first))} & steps


@pytest.mark.parametrize(
    ("text", "how", "why"),
    [
        ("\n\n", {}, "no corners in it"),
        ("0 0\n1 0", {}, r"area='.*': ring 1: 2 corner\(s\), want >= 3"),
        ("0 0\n1 0\n1 1\n\n0 0\n1 x\n0 1", {}, "ring 2: line 6: 'x' must be a number"),
        ("x,y\n0,0\n1,0\n1,1\n\n\n0,0\n1\n0,1", {}, r"ring 2: line 8: 1 column\(s\), want 2"),
        ("0 0\n1 0\n1 1\n\nx y\n", {}, r"ring 2: 0 point\(s\), want >= 2"),
        ("0 0\n2 2\n2 0\n0 2", {}, r"ring 1 crosses itself at \(1, 1\) m"),
        ("0 0\n3 0\n3 3\n0 3\n\n2 1\n4 1\n4 2\n2 2", {}, r"ring 1 crosses ring 2 at \(3, 1\) m"),
        ("0 0\n0.3 0\n0.3 0.3\n0 0.3", {}, "m between the clearances"),
        ("0 0\n3000 0\n3000 2000\n0 2000", {}, "want 0 to 500 lanes of 0.2 m"),
        ("0 0\n1 0\n1 1\n0 1", {"overlap": 0.2}, "overlap=0.2 must be < width=0.2"),
        (PARTED, {}, r"no way leads on to \(.*\) m: drive the area in parts"),
    ],
)
def test_what_cannot_be_covered_is_refused_in_words(text, how, why, tmp_path):
    with pytest.raises(ValueError, match=why):
        made(tmp_path, text, **how)


def test_what_would_take_for_ever_is_refused(tmp_path, monkeypatch):
    angles = np.arange(400) * 2 * np.pi / 400
    circle = "\n".join(f"{3 * np.cos(a)} {3 * np.sin(a)}" for a in angles)
    with pytest.raises(ValueError, match="400 corners, want <= 300: leave some out"):
        made(tmp_path, circle)
    monkeypatch.setattr(lanes_module, "MOST_LOOKS", 1000)
    with pytest.raises(ValueError, match="11 lanes and 4 corners are too many to find a way"):
        made(tmp_path, "0 0\n2 0\n2 2\n0 2\n")


@pytest.mark.parametrize(
    "text",
    [
        "y,x\n0,0\n0,3\n2,3\n2,0\n\n0.6,1\n0.6,2\n1.4,2\n",
        "# roof\n\nn,y,x\n\na,0,0\nb,0,3\nc,2,3\nd,2,0\n\n# a\n\ne,0.6,1\nf,0.6,2\ng,1.4,2\n# end",
        "# y x\n0 0\n0 3\n2 3\n2 0\n \n# hole\n0.6 1\n0.6 2\n1.4 2\n\n# end\n",
        "y x\n0 0\n0 3\n2 3\n2 0\n\nx;y\n1;0,6\n2;0,6\n2;1,4\n",
    ],
    ids=["a header", "one by itself", "in a comment", "one each"],
)
def test_a_header_holds_for_all_rings_below_it(text, tmp_path):
    (tmp_path / "area").write_text(text)
    ring, hole = read_area(str(tmp_path / "area"), 0.1).rings
    np.testing.assert_array_equal(ring, [[0, 0], [3, 0], [3, 2], [0, 2]])
    np.testing.assert_array_equal(hole, [[1, 0.6], [2, 0.6], [2, 1.4]])


def test_shapes_of_one_ring_are_like_any_other_file_of_points(tmp_path):
    file = tmp_path / "ring.csv"
    points = Circle(1.0).derivatives(np.arange(0.0, 6.2, 0.1))[0]
    np.savetxt(file, points, header="x y", comments="# ")
    np.testing.assert_allclose(read_area(str(file), 0.1).rings[0], points, atol=1e-9)
