"""`python -m shoal_validation.random_contacts [--seeds A:B]`.

Draws planar machines with contacts by seed (0:200), runs each with the default settings and their estimates of the
errors, and compares it with Newton's and Euler's equations that try every mode of the contacts, written for this alone:

balls   one to three balls between a sloping floor and two walls
block   a block that tumbles on a slope with its corners
chain   one to three pinned links whose ends strike a floor
drum    a disc in a hole of the ground or of a body on a pin

Each up to its twelfth impact. A run that is rejected, as of a near graze or of a paradox of friction, is `refused`.
"""

import sys

from shoal_validation.random_contacts.study import judged
from shoal_validation.random_machines import main

if __name__ == "__main__":
    main("random_contacts", __doc__, judged, sys.argv[1:])
