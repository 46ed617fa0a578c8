"""Safety of HDF5 files from other people: references to other files are found before any data is read."""

from __future__ import annotations

from typing import Any

_KINDS = {1: "a soft link", 64: "a link to another file"}  # by HDF5's number of the kind; a hard link has 0


def leads_out(file: Any) -> str:
    """Return text on the first item of an open HDF5 file that refers elsewhere; "" if the file is self-contained.

    HDF5 can refer to other files by links, as storage of a dataset, or as parts of a virtual dataset, and it opens them
    without asking. A malicious file could thereby show the content of any file that the user may read.
    """
    import h5py

    links: list[tuple[bytes, int]] = []
    file.id.links.visit(lambda name, link: links.append((name, int(link.type))), info=True)
    for name, kind in links:
        if kind:
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
