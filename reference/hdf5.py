"""HDF5 files from other people: what leads out of a file is refused before anything is read."""

from __future__ import annotations

from typing import Any

_KINDS = {"SoftLink": "a soft link", "ExternalLink": "a link to another file"}


def leads_out(file: Any) -> str:
    """Return what in an open HDF5 file leads elsewhere, by its name; "" where the file holds everything itself.

    HDF5 can name other files as links, as the storage of a dataset, or as parts of a virtual dataset, and opens them
    without asking: a file could so show the contents of any other that its reader may read.
    """
    import h5py

    links: list[tuple[str, str]] = []
    file.visititems_links(lambda name, link: links.append((name, type(link).__name__)))
    for name, kind in links:
        if kind != "HardLink":
            return f"/{name} is {_KINDS.get(kind, f'a link of the kind {kind}')}"
    found: list[str] = []

    def look(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            if item.external:
                found.append(f"/{name} is stored in another file")
            elif item.is_virtual:
                found.append(f"/{name} is put together from other datasets")

    file.visititems(look)
    return found[0] if found else ""
