"""Other minima: whether an answer is the best one, and whether another fits as well.

Searches of their own look where a descent from the stated starts does not come: other frequencies between samples,
mirror images, more turns from sample to sample. Each is a row of one list; what it meets is a further minimum, and from
a better one the search goes on, with a finding. Minima that fit as well make the answer ambiguous.
"""
