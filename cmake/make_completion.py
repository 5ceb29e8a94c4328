"""Completion for bash, zsh and fish, made of the help texts: make_completion.py PATH_OF_KSCHUR FOLDER

Writes kschur.bash, _kschur (zsh) and kschur.fish: commands, their options, names where an option or a command wants one of some,
and files elsewhere. zsh and fish show what the options mean.
"""
import sys
from pathlib import Path

from help_texts import read_help

HEAD = "# Completion of kschur, made of its help texts.\n"
BASH = HEAD + """_kschur()
{
    local word=${COMP_WORDS[COMP_CWORD]} last=$((COMP_CWORD - 1)) names=
    # --format=json is three words here.
    if [[ $word == "=" ]]; then
        word=
    elif [[ ${COMP_WORDS[last]} == "=" ]]; then
        last=$((last - 1))
    fi
    if [[ $word == -* ]]; then
        case "${COMP_WORDS[1]}:${COMP_WORDS[2]}" in
@options@
        esac
    else
        case "$COMP_CWORD:${COMP_WORDS[1]}:${COMP_WORDS[2]}:${COMP_WORDS[last]}" in
@values@
        esac
    fi
    # Where none fits, bash takes files.
    COMPREPLY=($(compgen -W "$names" -- "$word"))
}
complete -o default -F _kschur kschur kschur-mpi
"""
ZSH = "#compdef kschur kschur-mpi\n" + HEAD + """_kschur_scene()
{
    if (( CURRENT == 2 )); then
        _values scene @scenes@
        return
    fi
    case $words[2] in
@scene_options@
    esac
}

_kschur()
{
    local -a commands
    commands=(
@commands@
    )
    if (( CURRENT == 2 )); then
        _describe command commands
        return
    fi
    shift words
    (( CURRENT-- ))
    case $words[1] in
@options@
    esac
}

_kschur "$@"
"""


def spellings(option):
    return [option.short, option.name] if option.short else [option.name]


def case(pattern, names):
    return f'        {pattern}) names="{" ".join(names)}" ;;'


def in_bash(commands, scenes):
    names = [command.name for command in commands]
    values = [case("1:*", names), case("2:help:*", names),
              case("2:scene:*|2:sweep:*|3:help:scene:*", scenes)]
    options = [case("-*", ["--help", "--version"])]
    for scene, own in scenes.items():
        values += [case(f"*:scene:{scene}:{option.name}|*:sweep:{scene}:{option.name}", option.choices)
                   for option in own if option.choices]
        for command in commands:
            if command.name in ("scene", "sweep"):
                every = [name for option in [*own, *command.options] for name in spellings(option)]
                options.append(case(f"{command.name}:{scene}", every))
    for command in commands:
        values += [case("|".join(f"*:{command.name}:*:{name}" for name in spellings(option)), option.choices)
                   for option in command.options if option.choices]
        options.append(case(f"{command.name}:*", [*(name for option in command.options for name in spellings(option)), "--help"]))
    return BASH.replace("@values@", "\n".join(values)).replace("@options@", "\n".join(options))


def quoted(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh_option(option):
    """An argument of _arguments: '(-m --modes)'{-m,--modes=}'[meaning]:N: '."""
    meaning = option.text.replace("\\", "\\\\").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")
    action = ""
    if option.choices:
        action = f":name:({' '.join(option.choices)})"
    elif option.value:
        value = option.value.replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")
        action = f":{value}:{'_files' if option.is_file else ' '}"
    names = f"{option.name}{'=' if option.value else ''}"
    if option.short:
        return f"'({option.short} {option.name})'{{{option.short},{names}}}{quoted(f'[{meaning}]{action}')}"
    return quoted(f"{names}[{meaning}]{action}")


def zsh_case(pattern, options, rest):
    lines = [f"_arguments {rest}", *(zsh_option(option) for option in options)]
    return f"    {pattern})\n        " + " \\\n            ".join(lines) + " ;;"


def in_zsh(commands, scenes):
    every = " ".join(scenes)
    names = [f"        {quoted(f'{command.name}:{command.summary}')}" for command in commands]
    output = next(command.options for command in commands if command.name == "scene")
    options = [zsh_case(command.name, command.options, "'*:file:_files'") for command in commands
               if command.name not in ("help", "scene")]
    options += ["    scene) _kschur_scene ;;",
                f"    help) _arguments '1:command:({' '.join(command.name for command in commands)})' '2:scene:({every})' ;;"]
    own = [zsh_case(scene, [*valued(own), *output], "'1: :'") for scene, own in scenes.items()]
    text = ZSH.replace("@scenes@", every).replace("@scene_options@", "\n".join(own))
    return text.replace("@commands@", "\n".join(names)).replace("@options@", "\n".join(options))


def valued(options):
    """Those of a scene, whose help names no value: all have one."""
    for option in options:
        option.value = option.value or "VALUE"
    return options


def in_fish(commands, scenes):
    lines = [HEAD + "complete -c kschur-mpi -w kschur"]
    for command in commands:
        lines.append(f"complete -c kschur -n __fish_use_subcommand -f -a {command.name} -d {quoted(command.summary)}")
    for command in commands:
        here = f"complete -c kschur -n '__fish_seen_subcommand_from {command.name}'"
        lines += [here + fish_option(option) for option in command.options]
    lines.append("complete -c kschur -n '__fish_seen_subcommand_from help scene sweep' -a " + quoted(" ".join(scenes)))
    lines.append("complete -c kschur -n '__fish_seen_subcommand_from help' -f -a " + quoted(" ".join(c.name for c in commands)))
    for scene, own in scenes.items():
        here = f"complete -c kschur -n '__fish_seen_subcommand_from {scene}'"
        lines += [here + fish_option(option) for option in valued(own)]
    return "\n".join(lines) + "\n"


def fish_option(option):
    line = f" -l {option.name[2:]}" + (f" -s {option.short[1:]}" if option.short else "")
    if option.choices:
        line += f" -x -a {quoted(' '.join(option.choices))}"
    elif option.value:
        line += " -r -F" if option.is_file else " -x"
    return f"{line} -d {quoted(option.text.split('; ')[0])}"


def main(program, folder):
    every, scenes = read_help(program)
    commands = [command for command in every if command.name]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "kschur.bash").write_text(in_bash(commands, scenes))
    (folder / "_kschur").write_text(in_zsh(commands, scenes))
    (folder / "kschur.fish").write_text(in_fish(commands, scenes))


main(*sys.argv[1:])
