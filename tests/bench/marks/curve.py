"""The annotator's curve: how good is the result after how many marks?

    COVOL_DATA=FOLDER /usr/bin/python3 tests/bench/marks/curve.py [--covol BINARY] [--quick]

Each draw begins with ten marks on the truth's outlines in three planes. Then, up to eighty,

  covol, own suggestions     a simulated annotator uses --suggest and marks the truth's outline in the slices that it names,
                             at the points nearest to the suggestions; if there are fewer suggestions than marks to set, the
                             next mark is set on the outline near a suggestion, as far from all marks as possible; if covol suggests
                             nothing (or fails), at a random position on the surface
  covol, random suggestions  random marks on the surface, uniform by area
  random walker, grow from seeds, variational alone
                             the same random marks (rivals.py describes how seeds are made from marks)
  shape-based                uses contours instead: the same number of marks on outlines in evenly spread slices, about eight per
                             contour (rivals.py)

Every mark is off by up to half a voxel along each axis. curve.csv has the medians and the worst of the draws, curve.png the
medians, curve.md the number of marks that each method needs for a median Dice of 0.95 and 0.9, and the minutes of clicking at
--seconds-per-mark.
"""
import math
import sys

import matplotlib

import annotator
import rivals
import truth
import variational
from common import Bench, pivot, summary, version_of

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COUNTS = annotator.CURVE_COUNTS
ENOUGH = (0.95, 0.9)  # levels of Dice; the tables list the numbers of marks that reach them
OWN, RANDOM, SHAPE = "covol, own suggestions", "covol, random suggestions", "shape-based"
STYLE = {OWN: ("tab:blue", "o-"), RANDOM: ("tab:blue", "s:"), "variational alone": ("tab:green", "-"), SHAPE: ("tab:orange", "--"),
         "random walker": ("tab:gray", "-"), "grow from seeds": ("tab:gray", "--")}


# ---- measuring -----------------------------------------------------------------------------------------------------

def with_suggestions(bench, structure, draw):
    """{count: columns}"""
    person = annotator.Annotator(structure, annotator.first_marks(structure, draw),
                                 annotator.generator(structure.name, "curve", draw, "own"))
    reported = {}
    for count, after in zip(COUNTS, (*COUNTS[1:], None)):
        wanted = after - count if after else 1
        answer = bench.covol.segment(structure, "--suggest", wanted, marks=person.marks)
        reported[count] = answer.columns(structure) | {"elsewhere": person.elsewhere}
        if after:
            person.mark(wanted, answer.report.get("evidence", {}).get("suggestions", []) if answer.mask is not None else [])
    return reported


def without_covol(structure, marks, draw):
    guess = rivals.variational(structure, marks)
    given = rivals.seeds(structure, marks, guess)
    contours = annotator.few_contours(structure, len(marks), draw)
    masks = {"variational alone": guess, SHAPE: rivals.shape_based(structure, structure.contour_axis, contours)}
    for name in ("random walker", "grow from seeds"):
        masks[name] = rivals.FROM_SEEDS[name](given) if given else None
    return {name: truth.score(structure, mask) for name, mask in masks.items()}


def measure(bench):
    rows = []
    others = version_of(truth, annotator, rivals, variational)
    for structure in bench.structures:
        print(structure.name, flush=True)
        for draw in bench.draws_of(structure):
            def add(method, count, columns):
                rows.append({"structure": structure.name, "marks": count, "draw": draw, "method": method} | columns)

            own = bench.once((structure.name, draw, OWN), lambda: {str(count): columns for count, columns in
                                                                        with_suggestions(bench, structure, draw).items()})
            marks = annotator.random_marks(structure, draw)
            for count in COUNTS:
                add(OWN, count, own[str(count)])
                add(RANDOM, count, bench.once((structure.name, draw, count, RANDOM), lambda: bench.covol.segment(
                    structure, marks=marks[:count]).columns(structure)))
                found = bench.once((structure.name, draw, count), lambda: without_covol(structure, marks[:count], draw), others)
                for method, columns in found.items():
                    add(method, count, columns)
    return rows


# ---- tables ------------------------------------------------------------------------------------------------------

def marks_until(reported, dice):
    """{(structure, method): the minimum count from which on the median Dice stays above the level}; inf: never"""
    minimum = {}
    for t in sorted(reported, key=lambda t: -t["marks"]):
        key = t["structure"], t["method"]
        if t["dice_median"] >= dice and minimum.get(key, (math.inf, True))[1]:
            minimum[key] = (t["marks"], True)
        else:
            minimum[key] = (minimum.get(key, (math.inf,))[0], False)
    return {key: count for key, (count, _) in minimum.items()}


def draw_plot(path, reported, note):
    names = list(dict.fromkeys(t["structure"] for t in reported))
    columns = min(4, len(names))
    figure, axes = plt.subplots(math.ceil(len(names) / columns), columns, squeeze=False, sharex=True, sharey=True,
                                figsize=(3 * columns, 2.6 * math.ceil(len(names) / columns) + 0.6))
    for ax, name in zip(axes.flat, names):
        for method, (color, line) in STYLE.items():
            points = [(t["marks"], t["dice_median"]) for t in reported if t["structure"] == name and t["method"] == method]
            ax.plot(*zip(*points), line, color=color, markersize=3, linewidth=1, label=method)
        ax.axhline(ENOUGH[0], color="black", linewidth=0.5)
        ax.set_title(name, fontsize=9)
        ax.set_ylim(0.5, 1)
        ax.tick_params(labelsize=7)
    for ax in axes.flat[len(names):]:
        ax.axis("off")
    for ax in axes[:, 0]:
        ax.set_ylabel("Dice, median", fontsize=8)
    for ax in axes.flat[max(0, len(names) - columns):len(names)]:
        ax.set_xlabel("marks", fontsize=8)
        ax.tick_params(labelbottom=True)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="lower center", ncols=3, fontsize=8, frameon=False)
    figure.suptitle(note, fontsize=7)
    figure.tight_layout(rect=(0, 0.55 / figure.get_figheight(), 1, 1))
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main():
    bench = Bench("curve", __doc__, 10, arguments=lambda parser: parser.add_argument(
        "--seconds-per-mark", type=float, default=4, help="that a person takes to find a place and click [%(default)s]"))
    rows = measure(bench)
    bench.write("curve_draws", rows)
    reported = summary(rows, ("structure", "method", "marks"))
    bench.write("curve", reported)
    draw_plot(bench.results / "curve.png", reported, bench.head())
    pace = bench.options.seconds_per_mark / 60
    first = [t for t in reported if t["marks"] == COUNTS[0]]
    blocks = []
    for dice in ENOUGH:
        needed = marks_until(reported, dice)
        words = {key: f"{count} ({count * pace:.1f} min)" if math.isfinite(count) else f"more than {COUNTS[-1]}"
                 for key, count in needed.items()}
        behind = [f"- {structure}: {method}" for (structure, method), count in needed.items() if count < needed[structure, OWN]]
        blocks += [f"Marks until the median Dice is {dice}, and minutes at {bench.options.seconds_per_mark:g} s a mark",
                   pivot(first, ("structure",), "method", lambda t: words[t["structure"], t["method"]]),
                   "\n".join(["Fewer than covol with its own suggestions:", "", *behind]) if behind else
                   "Nothing needs fewer than covol with its own suggestions."]
    ends = [row for row in rows if row["method"] == OWN and row["marks"] == COUNTS[-1]]
    blocks.append(f"For {sum(row['elsewhere'] for row in ends)} of {len(ends) * (COUNTS[-1] - COUNTS[0])} marks covol named no place "
                  "(or failed), and they went anywhere.")
    for count in (10, 20, 40, 80):
        blocks += [f"Dice with {count} marks, median", pivot([t for t in reported if t["marks"] == count], ("structure",), "method",
                                                             lambda t: f"{t['dice_median']:.3f}")]
    bench.write_text("# The annotator's curve", *blocks)
    return 0


if __name__ == "__main__":
    sys.exit(main())
