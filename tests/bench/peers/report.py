"""Tables and the chart of a run's results, from results.json."""
import math
from xml.sax.saxutils import escape

from measures import efficiency, interval, ratio_interval

# Engines are compared at the largest measured count up to this number of samples.
COMPARED_SAMPLES = 64


def compared(document):
    fitting = [n for n in document["samples"] if n <= COMPARED_SAMPLES]
    return max(fitting) if fitting else min(document["samples"])


def rows_of(engine, count):
    runs = engine["runs"]
    return runs[count] if count in runs else runs[str(count)]  # JSON keys are strings


def efficiencies(document, engine, count, error="relmse"):
    return [
        efficiency(row[error], row["cpu"], document["threads"]) for row in rows_of(engine, count)
    ]


def ratios(document, scene, name, error="relmse"):
    """The engine's efficiency over Tessera's with its interval, or None."""
    ours = scene["engines"].get("tessera")
    if ours is None or name not in scene["engines"]:
        return None
    count = compared(document)
    over = efficiencies(document, scene["engines"][name], count, error)
    under = efficiencies(document, ours, count, error)
    if any(math.isnan(v) for v in over + under):
        return None
    return ratio_interval(over, under)


def short(value, digits=3):
    """A number with this many digits: 0.00123, 12.3, 1.23M."""
    if value is None or math.isnan(value):
        return "-"
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if abs(value) >= size:
            return f"{value / size:.{digits}g}{unit}"
    return f"{value:.{digits}g}" if abs(value) >= 1e-4 or value == 0 else f"{value:.{digits - 1}e}"


def with_half(values):
    if any(math.isnan(v) for v in values):
        return "-"
    mean, half = interval(values)
    return (
        short(mean)
        if math.isnan(half) or mean == 0
        else f"{short(mean)} ±{100 * half / abs(mean):.0f}%"
    )


def ratio_text(ratio):
    if ratio is None or math.isnan(ratio[0]):
        return "-"
    if math.isnan(ratio[1]):
        return f"{ratio[0]:.2f}"
    return f"{ratio[0]:.2f} [{ratio[1]:.2f}, {ratio[2]:.2f}]"


def align(rows):
    """Columns as wide as their widest cell, the first one left-aligned."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w)
            for i, (cell, w) in enumerate(zip(row, widths))
        ).rstrip()
        for row in rows
    )


def scene_table(document, scene):
    count, threads = compared(document), document["threads"]
    width, height = document["size"]
    head = [
        scene["name"],
        "samples/s",
        "rays/s",
        *(f"relMSE {n}" for n in document["samples"]),
        f"eff {count}",
        "(trimmed)",
        "peer/Tessera",
        "(trimmed)",
        "start s",
        "peak MB",
        "bright",
        "against",
    ]
    rows = [head]
    ours = scene["engines"].get("tessera")
    for name, engine in scene["engines"].items():
        if "runs" not in engine:
            continue
        runs = rows_of(engine, count)
        seconds = [max(row["cpu"], 1e-9) / threads for row in runs]
        rays = [row["rays"] / s for row, s in zip(runs, seconds)] if runs[0]["rays"] else None
        mean, error = engine["brightness"]
        bright = "-"
        if ours:
            base, base_error = ours["brightness"]
            ratio = mean / base if base > 0 else math.nan
            spread = (
                ratio * math.hypot(error / mean, base_error / base)
                if mean > 0 and base > 0
                else math.nan
            )
            bright = f"{ratio:.4f} ±{1.96 * spread:.4f}"
        rows.append(
            [
                name,
                with_half([count * width * height / s for s in seconds]),
                with_half(rays) if rays else "-",
                *(
                    with_half([row["relmse"] for row in rows_of(engine, n)])
                    for n in document["samples"]
                ),
                with_half(efficiencies(document, engine, count)),
                with_half(efficiencies(document, engine, count, "relmse_trimmed")),
                ratio_text(ratios(document, scene, name)),
                ratio_text(ratios(document, scene, name, "relmse_trimmed")),
                f"{engine['start']:.2f}",
                f"{engine['peak_bytes'] / 1e6:.0f}",
                bright,
                engine["reference"],
            ]
        )
    text = (
        align(rows)
        + f"\ncommon reference: {scene['common']}, {document['reference'][0]} renders of "
        f"{document['reference'][1]} samples\n"
    )
    for name, why in scene["left_out"].items():
        text += f"left out: {name}: {why}\n"
    return text


def peers_of(document):
    """Names of all engines except our own, in the order of their first appearance."""
    seen = {}
    for scene in document["scenes"]:
        seen.update({name: None for name in scene["engines"] if name != "tessera"})
    return list(seen)


def summary(document):
    """Efficiency of each peer over Tessera's, in brackets without the worst pixels; the tables have
    the intervals."""
    names = peers_of(document)
    rows = [[f"peer/Tessera at {compared(document)} samples", *names]]
    for scene in document["scenes"]:
        cells = []
        for name in names:
            plain, trimmed = (
                ratios(document, scene, name, e) for e in ("relmse", "relmse_trimmed")
            )
            cells.append("-" if plain is None else f"{plain[0]:.2f} ({trimmed[0]:.2f})" if trimmed
                         else f"{plain[0]:.2f}")
        rows.append([scene["name"], *cells])
    return align(rows)


COLORS = ("#4269d0", "#efb118", "#ff725c", "#6cc5b0", "#3ca951", "#a463f2")


def svg(document):
    """Tessera's efficiency over each peer's, on a logarithmic axis: right of 1 Tessera is better.
    """
    names = peers_of(document)
    left, width, bar, gap, top = 150, 720, 12, 14, 70
    ends = []
    groups = []
    for scene in document["scenes"]:
        bars = []
        for i, name in enumerate(names):
            ratio = ratios(document, scene, name)
            if ratio is not None and not math.isnan(ratio[0]):
                value, low, high = 1 / ratio[0], 1 / ratio[2], 1 / ratio[1]
                bars.append((i, name, value, low, high))
                ends += [v for v in (value, low, high) if not math.isnan(v)]
        groups.append((scene["name"], bars))
    # Powers of two that enclose all ends, and half and twice in any case.
    powers = [math.log2(v) for v in (0.5, 2, *ends)]
    first, last = math.floor(min(powers)), math.ceil(max(powers))

    def x(value):
        return left + (width - left - 20) * (math.log2(value) - first) / (last - first)

    height = top + sum(max(len(bars), 1) * bar + gap for _, bars in groups) + 30
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="12" role="img">',
        '<title>Efficiency of Tessera over that of other path tracers</title>',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        f'<text x="10" y="20" font-size="14">1/(V T) of Tessera over that of the peer, '
        f'{compared(document)} samples, {document["threads"]} threads; '
        'right of 1 Tessera is ahead</text>',
    ]
    at = 10
    for i, name in enumerate(names):
        out.append(
            f'<rect x="{at}" y="32" width="10" height="10" fill="{COLORS[i % len(COLORS)]}"/>'
            f'<text x="{at + 14}" y="41">{escape(name)}</text>'
        )
        at += 30 + 7 * len(name)
    for power in range(first, last + 1):
        value = 2.0 ** power
        label = f"{value:g}" if power >= 0 else f"1/{2 ** -power}"
        stroke = "#333" if power == 0 else "#ddd"
        out.append(
            f'<line x1="{x(value):.1f}" y1="{top - 8}" x2="{x(value):.1f}" y2="{height - 26}" '
            f'stroke="{stroke}"/>'
            f'<text x="{x(value):.1f}" y="{height - 10}" text-anchor="middle">{label}</text>'
        )
    y = top
    for title, bars in groups:
        middle = y + max(len(bars), 1) * bar / 2 + 4
        out.append(
            f'<text x="{left - 10}" y="{middle:.1f}" text-anchor="end">{escape(title)}</text>'
        )
        for i, name, value, low, high in bars:
            start, end = sorted((x(1), x(value)))
            spread = "" if math.isnan(low) else f" [{low:.2f}, {high:.2f}]"
            out.append(
                f'<rect x="{start:.1f}" y="{y}" width="{max(end - start, 0.5):.1f}" '
                f'height="{bar - 2}" fill="{COLORS[i % len(COLORS)]}">'
                f'<title>{escape(name)}: {value:.2f}{spread}</title></rect>'
            )
            if not math.isnan(low):
                out.append(f'<line x1="{x(low):.1f}" y1="{y + bar / 2 - 1}" x2="{x(high):.1f}" '
                           f'y2="{y + bar / 2 - 1}" stroke="#000"/>')
            y += bar
        y += gap + (0 if bars else bar)
    out.append("</svg>")
    return "\n".join(out) + "\n"
