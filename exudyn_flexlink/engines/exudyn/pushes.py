"""The force of a contact on the part that it pushes, at many instants."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Contact, Mechanism, approach
from exudyn_flexlink.result import ContactHistory


def push_of(contact: Contact, q: FloatArray, v: FloatArray, press: FloatArray) -> FloatArray:
    """Force (instants, 2), N, on the first part where it presses by `press` (instants,), N."""
    at = approach(contact, q, v)
    push = press[:, None] * at.normal
    if contact.friction is not None:
        push = push + contact.friction.force(press, at.slip)[:, None] * at.along
    return np.asarray(push)


def bearing_forces(
    mechanism: Mechanism, poses: FloatArray, rates: FloatArray, pressing: FloatArray
) -> dict[str, FloatArray]:
    """Force (instants, 2), N, of each joint with clearance on the body of its second point.

    `pressing` (instants, contacts) are the normal forces of all contacts.
    """
    first = len(mechanism.contacts)
    return {
        own.name: -push_of(own, poses, rates, pressing[:, first + k])
        for k, own in enumerate(mechanism.bearings)
    }


def by_name(
    contacts: Sequence[Contact], histories: Sequence[ContactHistory]
) -> dict[str, ContactHistory]:
    """Histories of contacts by their names; both in one order."""
    return {own.name: history for own, history in zip(contacts, histories, strict=True)}
