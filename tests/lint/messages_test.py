"""No message begins with the name of a function, because users know files and options, but no functions.

    python3 tests/lint/messages_test.py SOURCE_DIR [--write]

A function's name at the beginning is recognised by its underscore, or by KNOWN; names of options are allowed there. --write
removes the names if the remaining expression is valid, and prints the other places.
"""
import pathlib
import re
import sys

# Names of functions without an underscore with which messages once began. Names of commands are not listed: a message
# may begin with the command that the user requested.
KNOWN = ("carried", "covering", "decimate", "densify", "orient", "placed", "rasterize", "separate", "offset")
NAME = r"(?P<name>[a-z]+(?:_[a-z]+)+|" + "|".join(KNOWN) + r")"
LEADING = re.compile('"' + NAME + ": ")
ALONE = re.compile('"' + NAME + r': "\s*(?:\+|<<)\s*')  # a literal that is only the name, and the operator after it
OPTION = re.compile(r'(?:Option\{|require(?:_valid)?\(|\.require\(|field\()\s*"([a-z_]+)"')
CODE = re.compile(r"^\s*(?://|\*)")
# Settings of the server of covol mark, which are not options; messages may begin with their names.
SETTINGS = ("frame_origins", "page_policy", "live_path", "max_message_bytes", "max_connections", "messages_per_second",
            "message_burst", "live_idle", "get_threads")


def sources(root):
    return sorted(path for folder in ("lib", "tools") for path in (root / folder).rglob("*") if path.suffix in (".h", ".cpp"))


def options_of(texts):
    return {name for text in texts for name in OPTION.findall(text)} | set(SETTINGS)


def problems_of(text, options):
    """(line number, name) of each literal that begins with a function's name."""
    for number, line in enumerate(text.splitlines(), 1):
        if CODE.match(line):
            continue
        for found in LEADING.finditer(line.split(" // ")[0].split("///")[0]):
            if found["name"] not in options:
                yield number, found["name"]


def mended(text, options):
    for pattern, instead in ((ALONE, ""), (LEADING, '"')):
        text = pattern.sub(lambda found: found.group() if found["name"] in options else instead, text)
    return text


def self_test():
    options = {"tag_distance"}
    for bad in ('throw Error(Errc::Io, "read_points: " + path);', 'text << "tag_interior: expected";', '"densify: " + name'):
        assert list(problems_of(bad, options)), bad
    for good in ('"tag_distance: expected >= 0"', '"render: nothing to draw"', '// "read_points: path"', 'path + ": read_points"'):
        assert not list(problems_of(good, options)), good
    assert mended('f("read_points: " + path + ": x_y: no")', options) == 'f(path + ": x_y: no")'
    assert mended('s << "tag_interior: expected" << n', options) == 's << "expected" << n'
    assert mended('s << "placed_on: " << n', options) == "s << n"
    assert mended('"tag_distance: " + line', options) == '"tag_distance: " + line'


def main():
    self_test()
    root = pathlib.Path(sys.argv[1])
    texts = {path: path.read_text() for path in sources(root)}
    if len(texts) < 300:
        sys.exit(f"{root}: expected the sources of covol")
    options = options_of(texts.values())
    found = []
    for path, text in texts.items():
        if "--write" in sys.argv and list(problems_of(text, options)):
            text = mended(text, options)
            path.write_text(text)
        found += [f"{path.relative_to(root)}:{number}: a message begins with the function's name {name}"
                  for number, name in problems_of(text, options)]
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
