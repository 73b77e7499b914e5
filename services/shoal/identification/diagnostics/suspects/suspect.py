"""What a search for the cause of a misfit names."""

from __future__ import annotations

from dataclasses import dataclass

from shoal.identification.diagnostics.hypotheses import SIGNIFICANT

_CHANCE = 10.83
"""By how much one more parameter lowers a chi-square by chance once in a thousand times."""


@dataclass(frozen=True)
class Suspect:
    """Something taken as known, the value it was given, the fitted one, and the misfit (RMS) with either.

    change: the two values in words; unit: of the misfits, empty where channels of different units are taken together
    kind: `measurement`, `machine`, `data` (another reading of the recorded numbers) or `bounds` (of what is sought)
    numbers: how many were fitted beyond what is sought
    chance: p-value of what it explains, corrected for all hypotheses that were tested
    alike: other candidates of which a small fault has the same effect, whatever is measured by these channels
    """

    name: str
    stated: float
    value: float
    before: float
    after: float
    change: str
    unit: str = ""
    kind: str = "measurement"
    numbers: int = 1
    chance: float = 1.0
    alike: tuple[str, ...] = ()

    @property
    def significant(self) -> bool:
        """Return whether the data contradict what was taken as known."""
        return self.chance < SIGNIFICANT

    @property
    def words(self) -> str:
        """Its name as a sentence has it."""
        return f"offset in {self.name}" if self.name.split()[0] in ("x", "y") and self.kind != "data" else self.name

    def __str__(self) -> str:
        """In words, as a message names it."""
        misfit = f"the misfit from {self.before:.2g} to {self.after:.2g} {self.unit}".rstrip()
        return f"the {self.words}: {self.change} would lower {misfit}"

    def cost(self, rows: int) -> float:
        """What it leaves of so many rows, squared, and larger by what further numbers fit by chance."""
        return self.after**2 * penalty(self.numbers, rows)

    def equals(self, best: Suspect, rows: int) -> bool:
        """Return whether so many rows cannot tell it from the best one, which has no more numbers: alike within
        chance.
        """
        alike = self.after**2 <= best.after**2 * max(1.0 + _CHANCE / rows, 1.02)
        return alike and self.numbers <= best.numbers


def penalty(numbers: int, rows: int) -> float:
    """A factor on a mean square, for numbers beyond the first that were fitted to so many rows (Schwarz 1978)."""
    return float(rows ** ((numbers - 1) / rows))
