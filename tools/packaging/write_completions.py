"""Writes completions for bash, zsh and fish from the program's own description of its options.

    python3 write_completions.py BUILD/bin/covol FOLDER      FOLDER/covol (bash), FOLDER/_covol (zsh), FOLDER/covol.fish

They complete commands, flags, choices, and file names if a file is expected. Standard library only.
"""
import pathlib
import sys

from described import Program


def single_quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


# ---- bash -----------------------------------------------------------------------------------------------------------

BASH = r"""# Completion of covol for bash; made from the program's own options.
_covol() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command="" word flags
    # "--flag=value" comes as three words
    [[ $cur == "=" ]] && cur=""
    [[ $prev == "=" ]] && prev=${COMP_WORDS[COMP_CWORD-2]}
    for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
        case $word in
        @COMMANDS_OR@) command=$word; break ;;
        esac
    done
    COMPREPLY=()
    case $command:$prev in
@VALUES@
    esac
    if [[ -z $command && $cur != -* ]]; then
        COMPREPLY=($(compgen -W "@COMMANDS@" -- "$cur"))
        return
    fi
    if [[ $cur == -* ]]; then
        flags="@COMMON@"
        case $command in
@FLAGS@
        esac
        COMPREPLY=($(compgen -W "$flags" -- "$cur"))
        return
    fi
    compopt -o filenames 2>/dev/null
    COMPREPLY=($(compgen -f -- "$cur"))
}
complete -F _covol covol
"""


def bash(program):
    values = []
    for command in [program.common] + program.commands:
        for option in command.flags:
            pattern = "|".join(f"{command.name or '*'}:{flag}" for flag in option.flags)
            if option.words:
                values.append(f'    {pattern}) COMPREPLY=($(compgen -W "{" ".join(option.words)}" -- "$cur")); return ;;')
            elif option.takes_value and not option.is_file and not option.is_list:
                values.append(f"    {pattern}) return ;;")
    flags = [f'        {c.name}) flags+=" {" ".join(f for o in c.flags for f in o.flags)}" ;;' for c in program.commands]
    names = [c.name for c in program.commands]
    filled = BASH
    for mark, text in {"@COMMANDS_OR@": "|".join(names), "@COMMANDS@": " ".join(names), "@VALUES@": "\n".join(values),
                       "@COMMON@": " ".join(f for o in program.common.flags for f in o.flags),
                       "@FLAGS@": "\n".join(flags)}.items():
        filled = filled.replace(mark, text)
    return filled


# ---- zsh ------------------------------------------------------------------------------------------------------------

def zsh_text(text):
    return text.replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def zsh_option(option):
    if option.words:
        action = f":{zsh_text(option.value)}:({' '.join(option.words)})"
    elif option.takes_value:
        action = f":{zsh_text(option.value)}:" + ("_files" if option.is_file else "")
    else:
        action = ""
    repeated = "*" if option.is_list or "repeatable" in option.text else ""
    return [single_quoted(f"{repeated}{flag}[{zsh_text(option.text)}]{action}") for flag in option.flags]


def zsh(program):
    lines = ["#compdef covol", "# Completion of covol for zsh; made from the program's own options.", "_covol() {",
             "    local context state line command", "    local -a common commands", "    common=("]
    lines += ["        " + spec for option in program.common.flags for spec in zsh_option(option)]
    lines += ["    )", "    commands=("]
    lines += ["        " + single_quoted(f"{c.name}:{c.description}") for c in program.commands]
    lines += ["    )", "    _arguments -C $common '1: :->command' '*:: :->arguments'", "    case $state in",
              "    command) _describe -t commands 'covol command' commands ;;", "    arguments)", "        command=$words[1]",
              "        case $command in"]
    for command in program.commands:
        specs = [spec for option in command.flags for spec in zsh_option(option)] + ["'*:file:_files'"]
        lines.append(f"        {command.name}) _arguments -S $common \\")
        lines += ["            " + spec + (" \\" if n + 1 < len(specs) else " ;;") for n, spec in enumerate(specs)]
    return "\n".join(lines + ["        esac ;;", "    esac", "}", '_covol "$@"', ""])


# ---- fish -----------------------------------------------------------------------------------------------------------

def fish_option(option, condition):
    words = ["complete -c covol" + condition]
    for flag in option.flags:
        words.append(f"-l {flag[2:]}" if flag.startswith("--") else f"-s {flag[1:]}")
    if option.words:
        words.append("-x -a " + single_quoted(" ".join(option.words)))
    elif option.takes_value:
        words.append("-r" if option.is_file else "-x")
    return " ".join(words + ["-d " + single_quoted(option.text)])


def fish(program):
    lines = ["# Completion of covol for fish; made from the program's own options."]
    for command in program.commands:
        lines.append(f"complete -c covol -n __fish_use_subcommand -f -a {command.name} -d {single_quoted(command.description)}")
    lines += [fish_option(option, "") for option in program.common.flags]
    for command in program.commands:
        condition = f" -n {single_quoted('__fish_seen_subcommand_from ' + command.name)}"
        lines += [fish_option(option, condition) for option in command.flags]
    return "\n".join(lines + [""])


def main():
    program, folder = Program(sys.argv[1]), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in [("covol", bash), ("_covol", zsh), ("covol.fish", fish)]:
        (folder / name).write_text(make(program))


if __name__ == "__main__":
    main()
