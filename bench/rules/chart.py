# SPDX-License-Identifier: MIT
"""The chart of one experiment as SVG, written by hand: a lane for each client, from its start to 5 % error and to its
end, beside the bounds. Rules below each other, grouped by mode."""

import html

_COLOURS = {"modem": "#b3261e", "1024/256": "#1f6fb2", "2048/384": "#2e7d32"}
_OTHER = "#666666"
_LEFT, _RIGHT, _TOP, _FOOT = 170, 30, 84, 44
_WIDTH = 960
_MODES = {"paper": "paper mode", "ours": "our mode"}


def _nice_step(span, steps):
    """1, 2 or 5 times a power of ten, so that about `steps` of them make the span."""
    power = 10.0 ** -9
    while True:
        for digit in (1, 2, 5):
            if digit * power * steps >= span:
                return digit * power
        power *= 10


class _Svg:
    def __init__(self):
        self._parts = []

    def text(self, x, y, text, size=12, anchor="start", weight="normal", colour="#222"):
        self._parts.append(f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" '
                           f'font-weight="{weight}" fill="{colour}">{html.escape(text)}</text>')

    def line(self, x1, y1, x2, y2, colour="#ddd", width=1.0, dash=None):
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self._parts.append(f'<path d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}" stroke="{colour}" '
                           f'stroke-width="{width:g}"{dashes}/>')

    def bar(self, x, y, width, height, colour, opacity=1.0, title=None):
        inner = f"<title>{html.escape(title)}</title>" if title else ""
        self._parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="{max(width, 0.5):.1f}" height="{height:.1f}" '
                           f'fill="{colour}" fill-opacity="{opacity:g}">{inner}</rect>')

    def document(self, width, height):
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height:.0f}" width="{width}" '
                f'height="{height:.0f}" font-family="sans-serif">\n<rect width="100%" height="100%" fill="#fff"/>\n'
                + "\n".join(self._parts) + "\n</svg>\n")


def _legend(svg, lines):
    x = _LEFT
    for name in lines:
        colour = _COLOURS.get(name, _OTHER)
        svg.bar(x, 46, 14, 8, colour)
        svg.bar(x + 14, 46, 20, 8, colour, 0.35)
        svg.text(x + 40, 54, name, 11)
        x += 58 + 7 * len(name)
    svg.text(x, 54, "solid: to 5 % of the first level's error; pale: to the end; tick: bound of the end", 11,
             colour="#555")


def _axis(svg, longest, scale, bottom):
    step = _nice_step(longest, 8)
    value = 0.0
    while value <= longest * 1.0001:
        x = _LEFT + value * scale
        svg.line(x, _TOP - 6, x, bottom)
        svg.text(x, bottom + 16, f"{value:g}", 11, "middle", colour="#555")
        value = round(value + step, 9)
    svg.text(_LEFT + longest * scale / 2, bottom + 34, "seconds from each client's start", 11, "middle", colour="#555")


def draw(figures, key):
    """The SVG document of an experiment."""
    experiment = figures.experiments[key]
    # Slow lines first, so that lanes of one colour lie together.
    clients = sorted(figures.group(key, "all"), key=lambda client: (client.line.down_kbit, client.number))
    lane = 11 if len(clients) <= 6 else 4
    rows = sorted(figures.rows(key), key=lambda row: list(_MODES).index(row[1]))
    row_height = lane * len(clients) + 12
    ends = [figures.time(key, *row, client, "end") for row in rows for client in clients]
    longest = max([end for end in ends if end is not None] + [figures.bound(client, "end") for client in clients])
    scale = (_WIDTH - _LEFT - _RIGHT) / longest

    svg = _Svg()
    svg.text(_LEFT, 26, f"Experiment {key}: {experiment.title}", 16, weight="bold")
    _legend(svg, dict.fromkeys(client.line.name for client in clients))
    modes = list(dict.fromkeys(mode for _, mode in rows))
    bottom = _TOP + row_height * len(rows) + 22 * (len(modes) - 1)
    _axis(svg, longest, scale, bottom)
    y = _TOP
    for number, (rule, mode) in enumerate(rows):
        if number == 0 or rows[number - 1][1] != mode:
            y += 22 if number else 0
            svg.text(12, y - 2, _MODES[mode], 12, weight="bold", colour="#555")
            svg.line(12, y + 2, _WIDTH - _RIGHT, y + 2, "#999")
        svg.text(_LEFT - 36, y + row_height / 2 + 4, rule, 13, "end")
        for index, client in enumerate(clients):
            top = y + 6 + index * lane
            colour = _COLOURS.get(client.line.name, _OTHER)
            if len(clients) <= 6:
                svg.text(_LEFT - 6, top + lane - 3, str(client.number), 9, "end", colour="#777")
            to_five, to_end = (figures.time(key, rule, mode, client, figure) for figure in ("5 %", "end"))
            if to_end is None:
                svg.text(_LEFT + 4, top + lane - 2, f"client {client.number} did not end", 9, colour=colour)
                continue
            title = (f"client {client.number}, {client.line.name}, {client.mesh}: "
                     f"5 % {to_five:.2f} s, end {to_end:.2f} s")
            svg.bar(_LEFT, top, to_end * scale, lane - 1.5, colour, 0.35, title)
            svg.bar(_LEFT, top, to_five * scale, lane - 1.5, colour, 1, title)
            x = _LEFT + figures.bound(client, "end") * scale
            svg.line(x, top - 0.5, x, top + lane - 1, "#000", 1.5)
        y += row_height
        svg.line(_LEFT, y, _WIDTH - _RIGHT, y, "#eee")
    return svg.document(_WIDTH, bottom + _FOOT)
