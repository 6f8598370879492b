"""Options of a study of `covol mark`, from its journal (docs/study.md)."""
import json
import os

from ._errors import Error

_NUMBERS = ("voxel_size", "rho", "mark_precision")


def read_options(folder):
    """The study's current options: those of the last set_options that is not undone; {} if none was set."""
    path = os.path.join(folder, "journal.jsonl")
    if not os.path.isfile(path):
        raise Error(f"{path}: it does not exist; expected the journal of a study", "io")
    try:
        with open(path, "rb") as file:
            lines = file.read().split(b"\n")[:-1]  # an incomplete last line is omitted
    except OSError as error:
        raise Error(f"{path}: it cannot be read ({error.strerror})", "io") from None
    if not lines:
        raise Error(f"{path}: expected the journal of a study; it is empty", "invalid_input")
    _check_header(lines[0], path)
    done, undone = [], []  # options of each action; None for actions that leave them unchanged
    for number, line in enumerate(lines[1:], 2):
        try:
            action = json.loads(line)
            word = action["do"]
            options = _options_of(action["options"]) if word == "set_options" else None
        except (ValueError, KeyError, TypeError):
            raise Error(f"{path}: line {number} is damaged; "
                        "to keep the lines before it, delete this line and all after it", "invalid_input") from None
        if word in ("undo", "redo"):
            origin, target = (done, undone) if word == "undo" else (undone, done)
            if origin:
                target.append(origin.pop())
        else:
            done.append(options)
            undone.clear()
    return next((options for options in reversed(done) if options is not None), {})


def _options_of(given):
    options = {name: given[name] for name in _NUMBERS if name in given}
    for value in options.values():
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(value)
    options = {name: float(value) for name, value in options.items()}
    if "model" in given:
        if given["model"] not in ("guided", "paper"):
            raise ValueError(given["model"])
        options["model"] = given["model"]
    return options


def _check_header(line, path):
    try:
        version = json.loads(line)["covol_study"]
    except (ValueError, KeyError, TypeError):
        raise Error(f"{path}: expected the journal of a study, but its first line is not that of one",
                    "invalid_input") from None
    if version != 1:
        raise Error(f"{path}: its version is {version}, expected 1", "unsupported")
