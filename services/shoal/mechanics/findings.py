"""The kinds of findings about a motion, of every engine, from which its status follows."""

from __future__ import annotations

from shoal.findings import cautions, rejects
from shoal.trajectory import Status

SMALLER = "a smaller solver.step, or solver.relative_tolerance and solver.absolute_tolerance"
"""What cures a time error; the absolute tolerance is that of a motion of nanometres."""

REFUSED = rejects(
    "refused-by-engine", Status.REFUSED, "The engine does not compute the values of this lane, or the scene at all."
)
NO_START = rejects("no-start", Status.FAILED, "No start agrees with the joints and with what the scene states of it.")
ENGINE_STOPPED = rejects("engine-stopped", Status.FAILED, "The engine gave up before the end.")
STEPS_EXHAUSTED = rejects(
    "steps-exhausted", Status.FAILED, "The most steps that are allowed end before the motion does."
)
SINGULAR = rejects(
    "creeps-at-singular-position",
    Status.FAILED,
    "Branches of the motion cross where the machine is, and the motion does not show which one it is on.",
    "begin it farther away from that position, or with rates (initial, drives)",
)
NOT_FINITE = rejects("not-finite", Status.DIVERGED, "The motion stops being finite.")
NO_CONTACT_FORCE = rejects(
    "no-contact-force",
    Status.FAILED,
    "No force of a contact that slips keeps it closed, however large (Painleve's paradox): rigid bodies with so much "
    "friction have no motion there.",
    "a smaller mu, or another position",
)
SEVERAL_MOTIONS = rejects(
    "several-motions",
    Status.FAILED,
    "A contact that slips may stay closed or open, and nothing tells rigid bodies which (Painleve's paradox).",
    "a smaller mu, or another position",
)
UNDECIDED_CONTACTS = rejects(
    "contacts-undecided",
    Status.FAILED,
    "No forces of the contacts that touch were found that obey Coulomb's law.",
    "a smaller mu",
)
JAMMED_JOINT = rejects(
    "jammed-joint",
    Status.FAILED,
    "No force of a joint, or several, agree with the friction that depends on it (Painleve's paradox).",
    "a smaller mu, or another position",
)
ROPE_LEAVES = rejects(
    "rope-leaves",
    Status.FAILED,
    "A rope leaves a pulley or drum that the scene has it go over: its angle of contact is below zero.",
    "leave that pulley out of `over`, end the run before (solver.duration), or state the turns around it",
)
SPAN_VANISHES = rejects(
    "span-vanishes",
    Status.FAILED,
    "Two places that follow each other on a rope, or whose distance a coupling counts, meet or overlap; or a "
    "bushing is turned by half a turn, where its axis has no sense.",
    "end the run before (solver.duration), or add a contact or stop that keeps them apart",
)
SLACK = rejects(
    "slack",
    Status.FAILED,
    "A rope that keeps its length exactly would have to push.",
    "keeps: at-most, with which it goes slack",
)
TOO_MANY_EVENTS = rejects(
    "too-many-events",
    Status.FAILED,
    "Contacts strike, open, stick and slip ever again, without an end.",
    "a shorter solver.duration, or another restitution",
)
CHATTERS = rejects(
    "chatters",
    Status.FAILED,
    "Signals switch to and fro without end, as a relay that holds a machine on its switching line.",
    "tanh(x/width) in place of a step, or a dead band",
)
IMPACT_GAINS = rejects(
    "impact-gains-energy",
    Status.ENERGY,
    "The law of impact, with these coefficients of restitution at once or with friction, gains energy.",
    "less restitution or mu, the same restitution for contacts that strike together, or a law",
)
TORN_OPEN = rejects("joint-torn-open", Status.DIVERGED, "A joint opens without a drive, and the motion ends there.")
NOT_CLOSED = rejects("joint-not-closed", Status.DRIFTED, "A joint is open by more than the solver allows.")
OUT_OF_REACH = rejects(
    "out-of-reach", Status.OUT_OF_REACH, "A marker is farther away than the lengths of the bodies allow."
)
ENERGY = rejects(
    "energy-not-balanced",
    Status.ENERGY,
    "The energy error, relative to the energy in motion, is beyond solver.energy_tolerance.",
)
CAREFUL_REJECTED = rejects(
    "careful-run-rejected",
    Status.FAILED,
    "A more careful run, which shows the error, is itself rejected.",
    f"use {SMALLER}",
)
TIME_ERROR = rejects(
    "time-step-error",
    Status.FAILED,
    "A more careful run in time is more than a tenth of the machine's scale, or 0.1 rad, away.",
    f"use {SMALLER}, or a shorter solver.duration if the motion is chaotic",
)
DIFFERS = rejects(
    "differs-from-native",
    Status.FAILED,
    "Another engine and the native solver are more than a tenth of the machine's scale, or 0.1 rad, apart.",
    "see that the engine means the same by this scene, and use a smaller solver.step if it heeds that, or a shorter "
    "solver.duration if the motion is chaotic",
)
MESH_ERROR = rejects(
    "mesh-too-coarse",
    Status.FAILED,
    "Runs on finer meshes are more than a tenth of the machine's scale away.",
    "use more elements, or --tolerance to find them",
)
BENDING_ERROR = rejects(
    "bends-too-far",
    Status.FAILED,
    "Modal rods are for small bending, and cables in their place are more than a tenth of the scale away.",
    "use element: ancf-cable",
)
TOLERANCE_NOT_MET = rejects(
    "tolerance-not-met", Status.FAILED, "No model that was run has an error within the tolerance."
)
NOT_ESTIMATED = cautions(
    "error-not-estimated",
    "An error, of a source or of the chosen model, is not known.",
)
SHEAR_LEFT_OUT = cautions(
    "shear-left-out",
    "Shear and rotary inertia, which slender rods leave out, move a marker by more than a hundredth of the scale.",
)
BENDS_FAR = cautions("bends-far", "That modal rods bend far moves a marker by more than a hundredth of the scale.")
CREEPS = cautions(
    "friction-creeps",
    "What dry friction should hold creeps by more than a hundredth of the scale.",
    "lower coulomb_speed",
)
CONTACTS_OPEN = rejects(
    "open-contacts",
    Status.FAILED,
    "Decisions on contacts that the time error leaves open move a marker by more than a tenth of the machine's scale.",
    f"use {SMALLER}, or move the limit away from where it is just met",
)
NEAR_GRAZING = cautions(
    "near-grazing",
    "A one-sided constraint is met or missed by less than the run's own error: whether it is met is not decided.",
    f"use {SMALLER}, or move the limit away from where it is just met",
)
ORDER_OPEN = cautions(
    "order-of-impacts-not-resolved",
    "Two impacts are closer in time than their errors: which one comes first is not decided.",
    f"use {SMALLER}",
)
SIMULTANEOUS = cautions(
    "simultaneous-impact",
    "Contacts that touch at one instant share one impact (Moreau); one after the other they would leave other rates.",
)
UNCLEAR_CONTACTS = cautions(
    "contact-forces-not-unique",
    "Rigid contacts bear a load together, and how they share it, which nothing tells, decides on their friction.",
    "a law for each of these contacts, by which they give way",
)
EVENTS_DIFFER = cautions(
    "events-differ",
    "A more careful run has other impacts, openings or rests; their motions are compared in the time error.",
    f"use {SMALLER}",
)
SENSITIVE_SAMPLES = cautions(
    "sensitive-samples",
    "A measured value lies nearer to a tie between two roundings than the run is exact: a bit of it is not decided, "
    "nor is what follows from it.",
    f"use {SMALLER}",
)
POINT_REJECTED = cautions("point-rejected", "A lane that was run alone with its errors estimated is rejected.")
