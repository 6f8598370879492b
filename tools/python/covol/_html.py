"""HTML representation of the module's objects in notebooks."""
import html


def table(title, rows):
    cells = "".join(f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
                    f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>" for name, value in rows)
    return f"<div><b>{html.escape(title)}</b><table>{cells}</table></div>"


def numbers(values, digits=5):
    return ", ".join(f"{v:.{digits}g}" for v in values)


def image(img):
    return table("covol.Image", [
        ("shape (z, y, x)", img.shape), ("dtype", img.dtype), ("spacing (x, y, z)", f"{numbers(img.spacing)} {img.unit}"),
        ("origin (x, y, z)", numbers(img.origin)), ("path", img.path or "in memory")])


def points(cloud):
    rows = [("positions", len(cloud)), ("space", cloud.space), ("from", cloud.source), ("read as", cloud.rule)]
    if cloud.lines:
        rows.insert(1, ("lines", len(cloud.lines)))
    return table("covol.Points", rows)


def surface_rows(measures):
    state = f"closed, genus {measures['genus']}" if measures["closed"] else "not closed"
    return [("volume", f"{measures['volume']:.6g}"), ("area", f"{measures['area']:.6g}"),
            ("surface", f"{state}, {measures['components']} component{'' if measures['components'] == 1 else 's'}")]


def mesh(m):
    return table("covol.Mesh", [("vertices", len(m.vertices)), ("faces", len(m.faces))] + surface_rows(m.measure()))


def level_set(s):
    low, high = s.box
    return table("covol.LevelSet", [("voxel size", f"{s.voxel_size:.6g}"), ("box", f"{numbers(low)} to {numbers(high)}")])


def result(r):
    report = r.report
    rows = surface_rows(report["surface"])
    fit = report.get("fit", {}).get("points_to_surface")
    if fit:
        rows.append(("marks to surface", f"mean {fit['mean']:.4g}, 95 % {fit['p95']:.4g}, max {fit['max']:.4g}"))
    rows += [("voxels", f"{report['grid']['active_voxels']} of edge {report['grid']['voxel_size']:.6g}"),
             ("flow", f"{report['solve']['steps']} steps, {report['solve']['stop_reason']}"),
             ("time", f"{report['seconds']['total']:.3g} s")]
    rows += [(f"automatic: {what}", why) for what, why in report.get("automatic", {}).items()]
    rows += [("warning", line) for line in report["warnings"]]
    return table("covol.Result", rows)
