"""Writes lib/src/render/draw/font_data.cpp: outlines of the characters in pictures, from DejaVu Sans Condensed (Debian: fonts-dejavu-core,
fonts-dejavu-extra; python3-fonttools). Run it when further characters are needed:

    /usr/bin/python3 tools/font/write_font.py [FONT.ttf]
"""
import pathlib
import sys

from fontTools.pens.basePen import decomposeQuadraticSegment
from fontTools.pens.recordingPen import DecomposingRecordingPen
from fontTools.ttLib import TTFont

FONT = "/usr/share/fonts/truetype/dejavu/DejaVuSansCondensed.ttf"
ROOT = pathlib.Path(__file__).resolve().parents[2]
LETTERS = [chr(c) for c in range(32, 127)] + list("\xb0\xb1\xb2\xb3\xb5\xb7\xd7") + [chr(c) for c in range(0xc0, 0x100)
                                                                                      if c not in (0xd7, 0xf7)] + list("–−…�")
UNITS = 512  # units per em of the written outlines; the font file has 2048 units per em

HEAD = '''// Made by tools/font/write_font.py from DejaVu Sans Condensed 2.37; do not edit. Attribution and licence: docs/licences.md.
// A glyph: its code point, its advance, then steps in 1/512 em, y up, each from where the last one ended: m(ove to), l(ine),
// q(uadratic: control point, end).
#include "render/draw/font.h"

namespace covol::figure {

const char* const kGlyphs =
'''


def outline(font, letter):
    glyphs, scale = font.getGlyphSet(), UNITS / font["head"].unitsPerEm
    name = font.getBestCmap()[ord(letter)]
    pen = DecomposingRecordingPen(glyphs)
    glyphs[name].draw(pen)
    at, words = (0, 0), [f"{ord(letter)} {round(glyphs[name].width * scale)}"]

    def step(kind, *points):
        nonlocal at
        numbers = []
        for x, y in points:
            to = (round(x * scale), round(y * scale))
            numbers += [str(to[0] - at[0]), str(to[1] - at[1])]
            at = to
        words.append(kind + " ".join(numbers))

    for kind, points in pen.value:
        if kind == "qCurveTo" and points[-1] is None:  # a contour without on-curve points: starts at the middle of two control points
            first = tuple((a + b) / 2 for a, b in zip(points[0], points[-2]))
            step("m", first)
            kind, points = "qCurveTo", [*points[:-1], first]
        if kind == "moveTo":
            step("m", points[0])
        elif kind == "lineTo":
            step("l", points[0])
        elif kind == "qCurveTo":
            for control, end in decomposeQuadraticSegment(points):
                step("q", control, end)
    return "".join(words) + ";"


def main():
    font = TTFont(sys.argv[1] if len(sys.argv) > 1 else FONT)
    text = "".join(outline(font, letter) for letter in LETTERS)
    lines = [f'    "{text[n:n + 112]}"' for n in range(0, len(text), 112)]
    (ROOT / "lib/src/render/draw/font_data.cpp").write_text(HEAD + "\n".join(lines) + ";\n\n}  // namespace covol::figure\n")
    print(len(LETTERS), "glyphs,", len(lines), "lines")


if __name__ == "__main__":
    main()
