"""Unilateral constraints: gaps, forces of contact, impacts, stick and slip, location of their events."""
