"""The ten pages of the report in reading order; each has one template and one line here."""

from __future__ import annotations

from dataclasses import dataclass

FIRST_PAGE = "report.html"


@dataclass(frozen=True)
class Page:
    """A page: `id` names its template and its anchor, `name` is its link on top of every page."""

    id: str
    name: str

    @property
    def file(self) -> str:
        """Return the path of the page, relative to the folder of the report."""
        return FIRST_PAGE if self.id == "first" else f"report/{self.id}.html"


PAGES: tuple[Page, ...] = (
    Page("first", "First page"),
    Page("idea", "The idea"),
    Page("claims", "Claims"),
    Page("figures", "Figures"),
    Page("energy", "Energy"),
    Page("complementarity", "Complementarity"),
    Page("hard-cases", "Hard cases"),
    Page("speed", "Speed"),
    Page("effects", "Effects"),
    Page("data", "All data"),
)
