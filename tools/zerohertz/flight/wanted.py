"""A recording into a file, whole or the last seconds of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from zerohertz.errors import UserError
from zerohertz.flight.file import Ending, FlightWriter, Head
from zerohertz.flight.last_seconds import LastSeconds
from zerohertz.flight.record import Progress, Recorded, Recording, start
from zerohertz.link.client import Client

GoingOn = Callable[[Progress, float], bool]  # the period in seconds; False ends the recording


@dataclass(frozen=True)
class Wanted:
    """What to record, and when to end."""

    file: Path
    seconds: float = math.inf
    before_s: float | None = None  # keep only so many seconds
    after_fault_s: float | None = None  # end so long after a fault; None: a fault ends nothing

    def record(
        self, drive: Client, wait_s: float, say: Callable[[str], None], going_on: GoingOn
    ) -> Recorded:
        """Begins again behind a gap if only the last seconds are wanted, and no fault came."""
        while True:
            head, first = start(drive, wait_s, say)
            say(f"records {head.identity} into {self.file}")
            told = self._once(drive, head, first, going_on)
            if self.before_s is None or told.ending is not Ending.GAP or told.fault:
                return told
            say(
                f"a gap behind {self.file}: the link was too slow, at least {told.lost_periods} "
                "periods are lost; begins again when the drive is READY"
            )

    def _once(self, drive: Client, head: Head, first: bytes, going_on: GoingOn) -> Recorded:
        periods = self.seconds / head.period_s

        def more(p: Progress) -> bool:
            return going_on(p, head.period_s) and p.periods < periods

        if self.before_s is None:
            sink = FlightWriter(self.file, head)
            return Recording(drive, sink, head, first).run(more, self.after_fault_s)
        last = LastSeconds(self.file, head, self.before_s)
        told = Recording(drive, last, head, first).run(
            lambda p: more(p) and not last.objection, self.after_fault_s
        )
        if last.objection:
            raise UserError(last.objection)
        return replace(told, periods=last.kept_periods)
