"""Writes manual pages from the program's own description of its options: covol(1), and covol-COMMAND(1) for each command.

    python3 write_man.py BUILD/bin/covol FOLDER      FOLDER/covol.1.gz, FOLDER/covol-segment.1.gz, ...

Standard library only. The pages are reproducible.
"""
import gzip
import pathlib
import sys

from described import Program

EXAMPLES = {
    "segment": "covol segment stack.tif --points marks.csv -o cell.vdb --mesh cell.ply --mask cell.nrrd",
    "reconstruct": "covol reconstruct scan.ply -o scan.vdb --mesh scan.stl",
    "compare": "covol compare cell.nrrd truth.nrrd",
    "render": "covol render cell.vdb --image stack.tif --points marks.csv -o cell.png",
    "info": "covol info stack.tif",
    "mark": "covol mark stack.tif",
    "demo": "covol demo",
    "doctor": "covol doctor",
}


def roff(text):
    """Plain text, with escaped troff markup."""
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("^", "\\(ha").replace("~", "\\(ti")
    return "\\&" + text if text.startswith((".", "\\(aq")) else text


def option_lines(option):
    names = ", ".join(f"\\fB{roff(flag)}\\fR" for flag in option.flags)
    value = f"\\fI{roff(option.value)}\\fR" if option.value else ""
    text = option.text + (" (required)" if option.required else f" [{option.default}]" if option.default else "")
    return [".TP", " ".join(part for part in (names, value) if part), roff(text)]


def options_section(groups):
    lines = []
    for name, options in groups:
        if len(groups) > 1 and name != "Help":
            lines += [".SS " + roff(name)]
        for option in options:
            lines += option_lines(option)
    return lines


def synopsis(command):
    words = [f"\\fBcovol {command.name}\\fR"]
    words += [f"\\fI{roff(o.value)}\\fR" for o in command.positionals]
    words += [f"\\fB{roff(o.flags[0])}\\fR \\fI{roff(o.value)}\\fR" for o in command.flags if o.required]
    return " ".join(words + ["[\\fIoptions\\fR]"])


def head(name, version, description):
    return [f'.TH {name.upper()} 1 "" "covol {version}" "User Commands"', ".SH NAME", f"{roff(name)} \\- {roff(description)}"]


def command_page(command, program):
    lines = head(f"covol-{command.name}", program.version, command.description[0].lower() + command.description[1:])
    lines += [".SH SYNOPSIS", synopsis(command), ".SH DESCRIPTION", roff(command.description) + ".",
              "Lengths are world units, or voxels as in 3vx. What is chosen where an option is not given stands in brackets.",
              ".SH OPTIONS"] + options_section(command.groups)
    lines += [".SS Every command"] + [line for option in program.common.options for line in option_lines(option)]
    if command.name in EXAMPLES:
        lines += [".SH EXAMPLE", ".EX", roff(EXAMPLES[command.name]), ".EE"]
    return lines + [".SH SEE ALSO", ".BR covol (1)"]


def program_page(program):
    lines = head("covol", program.version, "surfaces of structures in 3D images and of point clouds")
    lines += [".SH SYNOPSIS", "\\fBcovol\\fR \\fICOMMAND\\fR [\\fIoptions\\fR]", ".SH DESCRIPTION",
              "covol finds the surface of a structure in a 3D image with the help of a few marked points, and the surface "
              "behind a point cloud without normals, on sparse OpenVDB level sets.", ".SH COMMANDS"]
    for command in program.commands:
        lines += [".TP", f".BR covol\\-{command.name} (1)", roff(command.description)]
    lines += [".SH OPTIONS"] + options_section(program.common.groups)
    lines += [".SH EXIT STATUS"]
    for code, what in [("0", "done"), ("1", "a defect of covol"), ("2", "the command line cannot be understood"),
                       ("3", "bad input or options"), ("4", "a file cannot be read or written"),
                       ("5", "a warning was said, with \\-\\-strict"), ("6", "numerical trouble"), ("130", "interrupted")]:
        lines += [".TP", code, what]
    return lines


def main():
    program, folder = Program(sys.argv[1]), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    pages = {"covol": program_page(program)}
    pages.update({f"covol-{c.name}": command_page(c, program) for c in program.commands})
    for name, lines in pages.items():
        (folder / f"{name}.1.gz").write_bytes(gzip.compress("\n".join(lines + [""]).encode(), 9, mtime=0))


if __name__ == "__main__":
    main()
