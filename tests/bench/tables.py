"""Tables in Markdown, and the line above them that states when, where and with which covol they were made."""
import datetime
import functools
import os
import pathlib
import platform
import subprocess

HERE = pathlib.Path(__file__).resolve().parent


@functools.cache
def provenance():
    model = platform.processor()
    with open("/proc/cpuinfo") as file:
        model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), model)
    commit = subprocess.run(["git", "-C", HERE, "describe", "--always", "--dirty", "--exclude", "*"],
                            capture_output=True, text=True).stdout.strip()
    cores = len(os.sched_getaffinity(0))
    return f"{datetime.date.today()}, {model}, {cores} cores (load average before the run: {os.getloadavg()[0]:.1f}), covol {commit or 'of unknown version'}"


def short(text):
    try:
        value = float(text)
    except ValueError:
        return text
    return f"{value:.0f}" if value == int(value) or abs(value) >= 100 else f"{value:.3g}"


def markdown(rows, columns=None):
    columns = columns or list(rows[0])
    lines = ["| " + " | ".join(c.replace("_", " ") for c in columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(short(row[c]) for c in columns) + " |" for row in rows]
    return "\n".join(lines)
