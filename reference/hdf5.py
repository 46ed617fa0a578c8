"""HDF5 files from other people: what leads out of a file is refused before anything is read."""

from __future__ import annotations

from typing import Any

_KINDS = {1: "a soft link", 64: "a link to another file"}  # by HDF5's number of the kind
_HARD = 0


def leads_out(file: Any) -> str:
    """Return what in an open HDF5 file leads elsewhere, by its name; "" where the file holds everything itself.

    HDF5 can name other files as links, as the storage of a dataset, or as parts of a virtual dataset, and opens them
    without asking: a file could so show the contents of any other that its reader may read.
    """
    import h5py

    links: list[tuple[bytes, int]] = []
    file.id.links.visit(lambda name, link: links.append((name, int(link.type))), info=True)
    for name, kind in links:
        if kind != _HARD:
            return f"/{name.decode()} is {_KINDS.get(kind, f'a link of the kind {kind}')}"
    for name, _ in links:
        item = h5py.h5o.open(file.id, name)
        if isinstance(item, h5py.h5d.DatasetID):
            made = item.get_create_plist()
            if made.get_external_count():
                return f"/{name.decode()} is stored in another file"
            if made.get_layout() == h5py.h5d.VIRTUAL:
                return f"/{name.decode()} is put together from other datasets"
    return ""
