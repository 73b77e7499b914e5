"""`python -m shoal_validation.random_contacts.jumps [--seeds A:B]`.

The machines of `shoal_validation.random_contacts` under forces and torques that begin and end at once: contacts open,
slip and stick at these jumps.
"""

import sys
from functools import partial

from shoal_validation.random_contacts.machines import pushed
from shoal_validation.random_contacts.study import judged
from shoal_validation.random_machines import main

if __name__ == "__main__":
    main("random_contacts.jumps", __doc__, partial(judged, machine_of=pushed), sys.argv[1:])
