import numpy as np
import pytest

from glotouch_bt.perception.touch import Contact, infer_outline_from_contacts, split_at_motion

R = 0.006


def contacts_on(centres, bearings, rng, radius=0.033):
    """Contacts with a disc that stands at `centres` (k, 2) when it is touched from `bearings` (k,)."""
    u = np.c_[np.cos(bearings), np.sin(bearings)]
    tips = centres + (radius + R) * u + rng.normal(0, 3e-4, u.shape)
    turn = bearings + rng.normal(0, 0.15, len(u))
    return tuple(
        Contact(0.0, np.array([*t, 0.018]), np.array([*-a, 0.0]), np.array([np.cos(b), np.sin(b), 0.0]), t - R * a, 1.0)
        for t, a, b in zip(tips, u, turn, strict=True)
    )


@pytest.mark.parametrize("shift", [0.0, 0.008, 0.015])
def test_motion_of_a_disc_is_detected(shift):
    """Ten contacts, the disc shoved unseen after the fifth; of eight trials at most one goes wrong."""
    right = 0
    for seed in range(8):
        rng = np.random.default_rng(seed)
        way = rng.uniform(0, 2 * np.pi)
        centres = np.zeros((10, 2))
        centres[5:] = shift * np.array([np.cos(way), np.sin(way)])
        contacts = contacts_on(centres, 2.4 * np.arange(10), rng)
        stray, kept = split_at_motion(contacts, R)
        assert stray + kept == contacts
        right += (len(stray) == 0) if shift == 0 else (4 <= len(stray) <= 6)
        if len(stray) == 5:
            assert np.linalg.norm(infer_outline_from_contacts(kept, R).centre_K_m - centres[-1]) < 1.5e-3
    assert right >= 7


def test_few_contacts_are_not_split():
    contacts = contacts_on(np.zeros((3, 2)), np.arange(3), np.random.default_rng(0))
    assert split_at_motion(contacts, R) == ((), contacts)


def test_limbs_are_no_motion():
    """A body with three limbs that turns by a degree a contact: where a limb begins, the outline jumps by 14 mm."""
    for seed in range(8):
        rng = np.random.default_rng(seed)
        bearings = 2.4 * np.arange(12) + rng.uniform(0, 2 * np.pi)
        limbs = rng.uniform(0, 2 * np.pi) + np.array([0.0, 1.9, 4.1]) + np.deg2rad(1.0) * np.arange(12)[:, None]
        away = np.abs((bearings[:, None] - limbs + np.pi) % (2 * np.pi) - np.pi).min(axis=1)
        radius = np.where(away < 0.5, 0.034, 0.020)[:, None]
        contacts = contacts_on(np.zeros((12, 2)), bearings, rng, radius)
        assert split_at_motion(contacts, R) == ((), contacts)
