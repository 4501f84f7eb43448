"""The pairs of link and guide that may touch in a sleeve: contacts as others, by one law."""

from __future__ import annotations

from exudyn_flexlink.engines.exudyn.contact_log import ContactLog
from exudyn_flexlink.engines.exudyn.redundant.contacts import ContactItem
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.mechanism import Channel, Resolution, deepest_allowed, pairs


class ChannelItems:
    """All pairs of one channel; `first` is the number of the first among the run's contacts."""

    def __init__(
        self, system: System, channel: Channel, first: int, resolution: Resolution, log: ContactLog
    ) -> None:
        self.channel, self.resolution = channel, resolution
        self.contacts = [
            ContactItem(system, contact, first + k, resolution, log)
            for k, contact in enumerate(pairs(channel))
        ]
        self._deepest_allowed = deepest_allowed(channel)

    @property
    def broken(self) -> bool:
        """Whether the link is so deep in a wall that it can't come back."""
        return any(contact.depth > self._deepest_allowed for contact in self.contacts)
