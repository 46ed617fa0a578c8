"""Curves that the page's script can read: an SVG that tells where its axes are and which curve is which.

Without the script it is the drawing that it was. The script needs no other copy of the values: it reads them from
the paths, which hold every point that is farther than TOLERANCE from a straight line between its neighbours.
"""

from __future__ import annotations

from typing import Any

from reports.figures.svg import to_svg

TOLERANCE = 0.01  # points, 1/30000 of the width of a panel: peaks and corners stay, straight runs go
DECIMALS = 2  # of points
TIME, PATH = "time", "path"  # a curve over time may be zoomed along t alone; a path in the plane both ways


def curve_id(name: str) -> str:
    """Return the `gid` of a curve; the legend toggles curves by this name."""
    return f"curve={name}"


def traced_svg(drawing: Any, key: str, kind: str = TIME) -> str:
    """Return the SVG of a drawing with one pair of axes, with what a script needs to read values off it."""
    import matplotlib

    (axes,) = drawing.axes
    for name in "xy":
        axis = getattr(axes, f"{name}axis")
        axis.set_gid(f"axis={name}")
        axis.label.set_gid(f"label={name}")
    with matplotlib.rc_context({"path.simplify_threshold": TOLERANCE}):
        for line in axes.lines:
            line.get_path().simplify_threshold = TOLERANCE
        svg = to_svg(drawing, key, DECIMALS)
    return svg.replace("<svg ", f"<svg {_attributes(drawing, axes, kind)} ", 1)


def _attributes(drawing: Any, axes: Any, kind: str) -> str:
    """Return the frame of the axes in the drawing's points (left, top, right, bottom), their limits and names."""
    width, height = 72.0 * drawing.get_size_inches()
    place = axes.get_position()
    frame = (width * place.x0, height * (1.0 - place.y1), width * place.x1, height * (1.0 - place.y0))
    given = {
        "trace": kind, "frame": _numbers(frame), "x": _numbers(axes.get_xlim()), "y": _numbers(axes.get_ylim()),
        "names": f"{axes.get_xlabel()}|{axes.get_ylabel()}",
    }  # fmt: skip
    return " ".join(f'data-{name}="{value}"' for name, value in given.items())


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.7g}" for value in values)
