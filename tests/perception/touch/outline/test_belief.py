"""The belief against ideal shapes and sections of the missions' meshes, touched by a ball in the plane."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from glotouch_bt.perception import touch
from glotouch_bt.perception.touch import current_tips, infer_outline, signed_distance
from glotouch_bt.perception.touch.outline import mixture
from glotouch_bt.perception.touch.outline.primitives import rounded, wrapped
from glotouch_bt.robot import ParamError
from tests.perception.touch.outline.conftest import rectangle, turned

R = 0.006


def disc(radius):
    a = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    return radius * np.c_[np.cos(a), np.sin(a)]


def explore(bench, discs, rng, contacts, noise=3e-4):
    """A chance contact, then where the belief is least certain, straight towards its centre."""
    middle, tips, ways, blocked = discs[0].mean(axis=0), [], [], []
    a = rng.uniform(0, 2 * np.pi)
    start, goal = middle - 0.15 * np.array([np.cos(a), np.sin(a)]), middle
    while True:
        tip = bench.touch(discs, start, goal)
        if tip is not None:
            tips.append(tip + rng.normal(0, noise, 2))
            ways.append((goal - start) / np.linalg.norm(goal - start))
        belief = infer_outline(np.array(tips), R, approach_K=np.array(ways))
        if len(tips) == contacts:
            return belief
        bearing = least_certain(belief, np.array(blocked))
        if tip is None:
            blocked.append(bearing)
        goal = belief.centre_K_m if tip is not None else middle
        start = goal + 0.15 * np.array([np.cos(bearing), np.sin(bearing)])


def least_certain(belief, blocked=()):
    """Return the bearing of the largest standard deviation, at least 15 degrees from the blocked ones if possible."""
    bearings = np.linspace(-np.pi, np.pi, 72, endpoint=False)
    sd = belief.predict(bearings)[1]
    if len(blocked):
        near = np.min(np.abs(wrapped(bearings[:, None] - blocked)), axis=1) < np.deg2rad(15.0)
        sd = sd if near.all() else np.where(near, -1.0, sd)
    return float(bearings[int(np.argmax(sd))])


def truth(discs):
    """Centroid of the hull of what the ball feels: of the points of a fine grid within its support function."""
    a = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    n = np.c_[np.cos(a), np.sin(a)]
    h = (discs[0] @ n.T + discs[1][:, None]).max(axis=0) - R
    grid = np.stack(np.meshgrid(np.linspace(-0.08, 0.08, 161), np.linspace(-0.08, 0.08, 161)), -1).reshape(-1, 2)
    grid = grid + discs[0].mean(axis=0)
    return grid[(grid @ n.T <= h).all(axis=1)].mean(axis=0)


@pytest.mark.parametrize(
    ("shape", "family"),
    [(disc(0.03), "circle"), (rectangle(0.08, 0.05), "rectangle"), (rectangle(0.1, 0.03), "rectangle")],
)
def test_plain_shapes_get_their_family(bench, shape, family):
    """Eight contacts: the family, the centre to a millimetre, and a free outline wins never."""
    right, errors = 0, []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        shift = rng.uniform(-0.1, 0.1, 2)
        belief = explore(bench, turned(bench.polygon_discs(shape), rng.uniform(0, 6), shift), rng, 8)
        right += belief.family == family
        errors.append(np.linalg.norm(belief.centre_K_m - shift))
    assert right >= 7
    assert np.median(errors) < 1e-3


@pytest.mark.parametrize("name", ["nailong", "wukong"])
def test_figures_get_the_free_family(bench, name):
    """Limbs make no circle and no rectangle; the centre is that of the hull."""
    discs = bench.mesh_discs(bench.objects / f"{name}.stl", 0.018, np.random.default_rng(0))
    centre = truth(discs)
    errors = []
    for seed in range(4):
        belief = explore(bench, discs, np.random.default_rng(seed), 10)
        c = belief.contour
        assert c.family == "free"
        assert c.rms_m < 0.0015
        errors.append(np.linalg.norm(c.centre_K_m - centre))
        np.testing.assert_allclose(signed_distance(c, c.boundary_K_m), 0.0, atol=1e-9)
        hull = ConvexHull(c.boundary_K_m)
        assert c.size_m[0] * c.size_m[1] >= hull.volume - 1e-9
        assert c.covariance.shape == (2, 2)
    assert np.median(errors) < 4e-3


def test_prediction_intervals_cover_the_contacts(bench):
    """Of distances predicted on boxes and figures after 4 to 10 contacts, most lie within two standard deviations."""
    shapes = [bench.polygon_discs(rectangle(0.08, 0.045)), bench.polygon_discs(disc(0.028))]
    shapes += [
        bench.mesh_discs(bench.objects / f"{n}.stl", 0.018, np.random.default_rng(0)) for n in ("truck", "nailong")
    ]
    within = []
    for discs in shapes:
        for contacts in (4, 7, 10):
            belief = explore(bench, discs, np.random.default_rng(contacts), contacts)
            bearing = np.linspace(-np.pi, np.pi, 24, endpoint=False)
            distance, sd = belief.predict(bearing)
            u = np.c_[np.cos(bearing), np.sin(bearing)]
            for way, d, s in zip(u, distance, sd, strict=True):
                tip = bench.touch(discs, belief.centre_K_m + 0.2 * way, belief.centre_K_m)
                if tip is not None:
                    within.append(abs(np.linalg.norm(tip - belief.centre_K_m) - d) < 2 * s + 2e-4)
    assert np.mean(within) > 0.8


def test_one_two_three_contacts():
    """From the first contact on the object lies ahead, hand-sized, and least certain where nothing was touched."""
    tips, ways = np.array([[0.0, 0.0], [-0.06, 0.03], [-0.06, -0.03]]), np.array([[-1.0, 0], [0.7, -0.7], [0.7, 0.7]])
    for k in (1, 2, 3):
        b = infer_outline(tips[:k], R, approach_K=ways[:k])
        assert -0.06 < b.centre_K_m[0] < -0.02
        assert np.isfinite(b.centre_sd_m).all()
        at_tip = np.arctan2(*(tips[0] - b.centre_K_m)[::-1])
        distance, sd = b.predict(np.array([at_tip, at_tip + np.pi]))
        assert distance[0] == pytest.approx(np.linalg.norm(tips[0] - b.centre_K_m), abs=1e-3)
        if k == 1:
            assert sd[1] > 0.015 > 5 * sd[0]
            assert np.cos(least_certain(b) - at_tip) < -0.5


def test_reaction_determines_the_direction_of_the_centre():
    """A single contact on a slanted face: the force, not the approach, says where the middle is."""
    normal = np.array([np.cos(0.5), np.sin(0.5)])
    b = infer_outline(np.zeros((1, 2)), R, approach_K=np.array([[-1.0, 0.0]]), reaction_K=normal[None])
    assert np.arctan2(*(-b.centre_K_m)[::-1]) == pytest.approx(0.5, abs=0.05)


def test_outline_is_equivariant_to_rigid_motions(bench):
    """Turning and shifting everything turns and shifts the belief."""
    tips, _ = bench.trace(bench.polygon_discs(rectangle(0.07, 0.04)), np.random.default_rng(3), 3e-4, touch, contacts=7)
    here = infer_outline(tips, R)
    c, s = np.cos(0.8), np.sin(0.8)
    turn = np.array([[c, s], [-s, c]])
    there = infer_outline(tips @ turn + [0.2, -0.1], R)
    np.testing.assert_allclose(there.centre_K_m, here.centre_K_m @ turn + [0.2, -0.1], atol=2e-4)
    np.testing.assert_allclose(there.contour.size_m, here.contour.size_m, atol=4e-4)
    assert abs(np.sin(there.contour.yaw_rad - here.contour.yaw_rad - 0.8)) < 0.02


def test_pushes_move_earlier_contacts():
    """The object is shoved by 2 mm along x after the second contact and by 1 mm along y after the third."""
    got = current_tips(np.zeros((4, 2)), np.array([[0, 0], [0.002, 0], [0, 0.001], [0, 0.0]]))
    np.testing.assert_allclose(got, [[0.002, 0.001], [0.002, 0.001], [0, 0.001], [0, 0]])
    with pytest.raises(ParamError):
        current_tips(np.zeros((4, 2)), np.zeros((3, 2)))


def test_pushed_disc_is_still_a_circle(bench):
    a = np.linspace(0, 6, 8)
    push = -0.001 * np.c_[np.cos(a), np.sin(a)]
    before = np.vstack([[0, 0], np.cumsum(push, axis=0)[:-1]])
    tips = before + 0.036 * np.c_[np.cos(a), np.sin(a)]
    b = infer_outline(tips, R, approach_K=-np.c_[np.cos(a), np.sin(a)], pushed_K_m=push)
    assert b.family == "circle"
    np.testing.assert_allclose(b.centre_K_m, push.sum(axis=0), atol=2e-4)
    assert infer_outline(tips, R).contour.rms_m > 10 * b.contour.rms_m or infer_outline(tips, R).family == "free"


@pytest.mark.parametrize("bad", [np.zeros((0, 2)), np.zeros((3, 4)), np.full((2, 2), np.nan)])
def test_invalid_contacts_are_refused(bad):
    with pytest.raises(ParamError, match="tip_K_m"):
        infer_outline(bad, R)
    with pytest.raises(ParamError, match="approach_K"):
        infer_outline(np.zeros((2, 2)), R, approach_K=np.zeros((3, 2)))


def test_untouched_side_is_uncertain():
    """A 104 x 44 mm box touched on three sides at one end: its length, and its middle along it, are not known."""
    tips = np.array([[-0.03, 0.028], [0.02, 0.028], [-0.058, 0.005], [-0.04, -0.028], [0.015, -0.028]])
    out = np.array([[0.0, 1.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.0, -1.0]])
    three = infer_outline(tips, 0.006, approach_K=-out, reaction_K=out)
    assert three.centre_sd_m[0] > 0.005
    assert three.centre_sd_m[1] < 0.002
    assert three.predict(np.array([0.0]))[1][0] > 0.010
    four = infer_outline(
        np.vstack([tips, [0.058, 0.0]]),
        0.006,
        approach_K=np.vstack([-out, [-1.0, 0.0]]),
        reaction_K=np.vstack([out, [1.0, 0.0]]),
    )
    assert four.centre_sd_m.max() < 0.002
    # the ball passed close by the far end: it stands no farther out than that
    near = infer_outline(tips, 0.006, approach_K=-out, reaction_K=out, free_K_m=np.array([[0.040, 0.0], [0.04, 0.01]]))
    assert near.centre_sd_m[0] < three.centre_sd_m[0]


LONG_FELT = np.array([
    [0.0, 0.0, 53, -132], [18.1, -19.3, 50, -128], [37.1, -37.1, 51, -121], [51.9, -51.2, -34, -144],
    [70.4, -57.9, 95, -54], [98.2, -28.8, 155, -31], [81.1, -5.0, -155, 36], [52.3, 22.6, -85, 57],
    [46.1, 28.4, 160, 36], [61.9, -58.0, 100, -123], [70.2, -58.4, 115, -54], [80.6, -47.1, 130, -48],
    [82.4, -44.8, 135, -45], [93.3, -18.0, 170, 4],
])  # fmt: skip
"""Ball centre x, y mm, bearings of approach and reaction deg: a simulated object 105 x 41 mm, one end never touched."""


@pytest.mark.parametrize("contacts", range(5, 15))
def test_rectangle_reaches_its_contacts(contacts):
    """The prior of sizes does not pull an end that nothing touched in past the contacts on the sides beside it."""
    tips, (approach, reaction) = 1e-3 * LONG_FELT[:contacts, :2], np.deg2rad(LONG_FELT[:contacts, 2:]).T
    belief = infer_outline(
        tips,
        R,
        approach_K=np.c_[np.cos(approach), np.sin(approach)],
        reaction_K=np.c_[np.cos(reaction), np.sin(reaction)],
    )
    x, y, yaw, *half = next(h.corrected for h in belief.hypotheses if h.shape is rounded and h.amplitude == 0)[:5]
    c, s = np.cos(yaw), np.sin(yaw)
    over = np.maximum(np.abs((tips - (x, y)) @ np.array([[c, -s], [s, c]])) - half, 0.0)
    assert np.linalg.norm(over, axis=1).max() - R < 0.002


@pytest.mark.parametrize(("long_m", "short_m", "nats"), [(0.100, 0.090, 7.0), (0.100, 0.076, 0.0), (0.060, 0.060, 0.0)])
def test_wide_contacts_are_less_likely_those_of_one_object(monkeypatch, long_m, short_m, nats):
    """Half a nat for each millimetre beyond 76 mm, across the narrowest direction."""
    x, y = 0.5 * long_m, 0.5 * short_m
    sides = [(s * (x + R), t * 0.5 * y) for s in (1, -1) for t in (1, -1)]
    sides += [(s * 0.5 * x, t * (y + R)) for s in (1, -1) for t in (1, -1)]
    with_prior = infer_outline(np.array(sides), R).log_evidence
    monkeypatch.setattr(mixture, "WIDE_NATS_PER_M", 0.0)
    assert infer_outline(np.array(sides), R).log_evidence - with_prior == pytest.approx(nats)
