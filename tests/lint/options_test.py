"""The tables of options in docs/commands are those of the program.

    python3 tests/lint/options_test.py BUILD/bin/covol SOURCE_DIR           prints which pages differ
    python3 tests/lint/options_test.py BUILD/bin/covol SOURCE_DIR --write   fills them in

A page has a place for each table: the text between the lines <!-- options: COMMAND --> and <!-- end of options --> is written by
this script. "common" are the options that every command takes, "commands" is the list of commands.
"""
import json
import pathlib
import re
import subprocess
import sys


def cell(text):
    return text.replace("|", "\\|")


def code(text):
    return f"`{cell(text)}`" if text else ""


def prose(text):
    """Help is written for a terminal: characters with a meaning in Markdown are escaped."""
    return re.sub(r"([<>*_\[\]])", r"\\\1", cell(text))


def table(groups):
    lines = []
    for group in groups:
        if group["name"] == "Help":
            continue
        if len(groups) > 2:
            lines += [f"**{group['name']}**", ""]
        lines += ["| option | value | default | |", "|---|---|---|---|"]
        for o in group["options"]:
            name = code(o["names"] or o["value"])
            value = code(o["value"]) if o["names"] else ""
            default = "required" if o["required"] else prose(o["default"])
            lines.append(f"| {name} | {value} | {default} | {prose(o['text'])} |")
        lines.append("")
    return lines


def tables(described):
    result = {c["name"]: table(c["groups"]) for c in described["commands"]}
    result["common"] = table(described["common"])
    result["commands"] = ["| command | |", "|---|---|"] + [
        f"| [{c['name']}]({c['name']}.md) | {prose(c['description'])} |" for c in described["commands"]] + [""]
    return result


def filled(text, made):
    def fill(match):
        return "\n".join([match[1], ""] + made[match[2]] + ["<!-- end of options -->"])
    return re.sub(r"(<!-- options: (\w+) -->)\n.*?<!-- end of options -->", fill, text, flags=re.S)


def main():
    program, root = sys.argv[1], pathlib.Path(sys.argv[2])
    described = json.loads(subprocess.run([program, "--describe-options"], capture_output=True, text=True, check=True).stdout)
    made = tables(described)
    found = [f"docs/commands/{c['name']}.md: missing" for c in described["commands"] if not (root / f"docs/commands/{c['name']}.md").exists()]
    for page in sorted((root / "docs/commands").glob("*.md")):
        text = page.read_text()
        wanted = "commands" if page.stem == "README" else page.stem
        if f"<!-- options: {wanted} -->" not in text:
            found.append(f"{page.relative_to(root)}: no place for the table of {wanted}")
        elif filled(text, made) != text:
            if "--write" in sys.argv:
                page.write_text(filled(text, made))
            else:
                found.append(f"{page.relative_to(root)}: the table is not what the program says; "
                             "python3 tests/lint/options_test.py BUILD/bin/covol . --write fills it in")
    print("\n".join(found) if found else "no finding")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
