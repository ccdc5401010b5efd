"""What a dataset is, in a file whose fields are checked against what was written there."""

from __future__ import annotations

import hashlib
import json
import platform
from importlib.metadata import version
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt

from wam_cast.version import __version__

FORMAT: Final = 3
"""Version of the directory's layout and of the columns."""

Engine = Literal["drake", "batch"]
"""What simulates casts."""

ROWS_PER_PART: Final = 50
"""Few enough that an interrupted run loses little."""

MOST_CASTS: Final = 1_000_000
"""That a dataset may have: more would not fit into memory."""


class Manifest(BaseModel):
    """What a dataset is.

    Attributes
    ----------
    format
        Version of the directory's layout.
    fingerprint
        Of the scenario, when the casts were made.
    controller
        Name of what made the controller, see `.controller_name`.
    engine
        What simulated the casts, see `.generate_dataset`. Landings of the two differ by about 1e-4 mm, with noise of the encoders
        by 0.1 mm.
    seed, n_casts
        Which casts, and how many a finished run has.
    rows_per_part
        Rows of each part but the last.
    versions
        Of the software: an entry for each combination that worked on the dataset.
    scenario
        The values that were written to `scenario.yaml`; None in older datasets.
    checksums
        Of the other fields, by name, as `sealed` adds them; None in older datasets.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal[3] = FORMAT
    fingerprint: str
    controller: str
    engine: Engine = "drake"
    seed: NonNegativeInt
    n_casts: Annotated[int, Field(ge=1, le=MOST_CASTS)]
    rows_per_part: Literal[50] = ROWS_PER_PART
    versions: tuple[dict[str, str], ...]
    scenario: dict[str, Any] | None = None
    checksums: dict[str, str] | None = None

    def sealed(self) -> Self:
        """Return the manifest with its checksums."""
        return self.model_copy(update={"checksums": self._checksums()})

    def changed_fields(self) -> list[str]:
        """Return the names of fields that do not match their checksums."""
        if self.checksums is None:
            return []
        now = self._checksums()
        # A field that came later has no checksum, and its default.
        later = {name for name in now.keys() - self.checksums.keys() if name not in self.model_fields_set}
        return [
            name
            for name in {**now, **self.checksums}
            if now.get(name) != self.checksums.get(name) and name not in later
        ]

    def _checksums(self) -> dict[str, str]:
        values = self.model_dump(mode="json", exclude={"checksums"})
        texts = {name: json.dumps(value, sort_keys=True) for name, value in values.items()}
        return {name: hashlib.sha256(text.encode()).hexdigest()[:16] for name, text in texts.items()}


def current_versions() -> dict[str, str]:
    """Return the versions of what a cast is made with."""
    packages = {package: version(package) for package in ("drake", "numpy")}
    return {"wam_cast": __version__, "python": platform.python_version()} | packages
