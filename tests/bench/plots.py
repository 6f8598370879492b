"""speed.png: whole jobs, cost over h, cost over the size of the image."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

OURS, OTHERS, MEMORY = "tab:blue", "tab:gray", "tab:orange"


def numbers(rows, column):
    return [float(row[column]) for row in rows]


def draw_sphere(axes, rows):
    shown = [r for r in rows if "octant" not in r["solver"] and "covol's steps" not in r["solver"]][::-1]
    seconds = numbers(shown, "seconds")
    names = [f"{r['solver']}, {r['threads']} thread{'s' if r['threads'] != '1' else ''}" for r in shown]
    axes.barh(names, seconds, color=[OURS if r["solver"].startswith("covol") else OTHERS for r in shown])
    for at, row in enumerate(shown):
        note = f" {seconds[at]:.{0 if seconds[at] >= 100 else 1}f} s"
        if row["error_shell"]:
            note += f", error {float(row['error_shell']):.2f} / {float(row['error_holes']):.2f}"
        if row["extrapolated"] not in ("no", ""):
            note += " *"
        axes.text(seconds[at], at, note, va="center", fontsize=7)
    axes.set_xscale("log")
    axes.set_xlim(min(seconds) / 2, max(seconds) * 40)
    axes.tick_params(axis="y", labelsize=7)
    axes.set_xlabel("seconds; error on the shell / in the holes in voxels\n* extrapolated, see the table", fontsize=8)
    axes.set_title("Sphere with six holes", fontsize=10)


def draw_growth_h(axes, rows):
    across = numbers(rows, "voxels_across")
    x = range(len(rows))
    times = lambda values: [value / values[0] for value in values]
    axes.plot(x, times(numbers(rows, "seconds")), "o-", color=OURS, label="time")
    axes.plot(x, times(numbers(rows, "peak_mib")), "s--", color=MEMORY, label="peak memory")
    axes.plot(x, times([n**2 for n in across]), ":", color=OTHERS, label="1/h², like the surface")
    axes.plot(x, times([n**3 for n in across]), "-.", color=OTHERS, label="1/h³, like a dense grid")
    axes.set_yscale("log")
    axes.set_xticks(x, [f"h/{n / across[0]:.0f}" if n > across[0] else "h" for n in across])
    axes.set_ylabel("times that at h", fontsize=8)
    axes.set_xlabel(f"voxel size; at h/8 {float(rows[-1]['active_voxels']) / 1e6:.1f} million voxels, "
                    f"{float(rows[-1]['seconds']):.0f} s", fontsize=8)
    axes.set_title("One shape, finer and finer", fontsize=10)
    axes.legend(fontsize=7, loc="upper left")


def draw_growth_image(axes, rows):
    x = range(len(rows))
    axes.plot(x, numbers(rows, "seconds"), "o-", color=OURS, label="time")
    axes.plot(x, numbers(rows, "seconds_without_read"), "o:", color=OURS, label="time without reading the image")
    axes.set_xticks(x, [f"{row['image_size']}³" for row in rows])
    axes.set_ylim(0, 2 * max(numbers(rows, "seconds")))
    axes.set_xlabel("voxels of the image", fontsize=8)
    axes.set_ylabel("seconds", fontsize=8)
    axes.set_title("One structure, larger and larger images", fontsize=10)
    memory = axes.twinx()
    mib = numbers(rows, "peak_without_image_mib")
    memory.plot(x, mib, "s--", color=MEMORY, label="peak memory without the image")
    memory.set_ylim(0, 2 * max(mib))
    memory.set_ylabel("MiB", fontsize=8)
    memory.tick_params(labelsize=7)
    lines = axes.get_lines() + memory.get_lines()
    axes.legend(lines, [line.get_label() for line in lines], fontsize=7, loc="upper left")


PANELS = {"sphere": draw_sphere, "growth_h": draw_growth_h, "growth_image": draw_growth_image}


def draw(path, results):
    """@param results  part -> (provenance, rows) or None"""
    panels = [part for part in PANELS if results.get(part)]
    if not panels:
        return
    widths = [1.5 if part == "sphere" else 1 for part in panels]
    figure, axes = plt.subplots(1, len(panels), figsize=(4.2 * sum(widths), 3.6), squeeze=False, width_ratios=widths)
    for ax, part in zip(axes[0], panels):
        PANELS[part](ax, results[part][1])
        ax.tick_params(labelsize=7)
    figure.suptitle(results[panels[0]][0], fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    plt.close(figure)
