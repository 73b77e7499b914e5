"""Open trees of rigid bodies in space, in recursive relative coordinates, at linear cost in the number of bodies."""
