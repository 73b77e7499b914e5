"""What a search for the cause of a misfit names."""

from __future__ import annotations

from dataclasses import dataclass

SEVERAL = 2.0
"""Times smaller: a misfit beyond the noise that falls by this factor is explained."""
_CHANCE = 10.83
"""By how much one more parameter lowers a chi-square by chance once in a thousand times."""
BY_CHANCE = 2 * _CHANCE
"""The same of the best of many."""


@dataclass(frozen=True)
class Suspect:
    """Something taken as known, the value it was given, the fitted one, and the misfit (RMS) with either.

    change: the two values in words; unit: of the misfits, empty where channels of different units are taken together
    kind: `measurement`, `machine`, `data` (another reading of the recorded numbers) or `bounds` (of what is sought)
    numbers: how many were fitted beyond what is sought
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
    alike: tuple[str, ...] = ()

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


def explains(before: float, after: float, noise: float, rows: int, by_chance: float = BY_CHANCE) -> bool:
    """Return whether a misfit that falls so, of so many rows with that noise, is explained: severalfold, not by chance.

    by_chance: of chi-square, how far noise alone may lower it
    """
    beyond = max(after**2 - noise**2, 0.0)
    severalfold = after * SEVERAL <= before or beyond * SEVERAL**2 <= before**2 - noise**2
    return severalfold and (before**2 - after**2) * rows > by_chance * max(after, noise) ** 2
