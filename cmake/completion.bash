# SPDX-License-Identifier: BSD-3-Clause
# Completion of vestige-explorer, vestige-mini-sim and vestige-replay in bash: commands and options as
# the program's own --help names them, then files.
_vestige() {
  local program=${COMP_WORDS[0]} word=${COMP_WORDS[COMP_CWORD]} command=() words
  if [[ $program == *explorer && $COMP_CWORD -gt 1 ]]; then command=("${COMP_WORDS[1]}"); fi
  if [[ $word == -* ]]; then
    words=$("$program" "${command[@]}" --help 2>/dev/null | grep -oE '^ +(-[a-zA-Z],)?--[a-z][a-z-]*' |
            grep -oE -- '--[a-z-]+')
  elif [[ $program == *explorer && $COMP_CWORD -eq 1 ]]; then
    words=$("$program" --help 2>/dev/null | sed -nE 's/^  ([a-z]+) +[A-Z].*/\1/p')
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  if [[ ${#COMPREPLY[@]} -eq 0 ]]; then mapfile -t COMPREPLY < <(compgen -f -- "$word"); fi
}
complete -o filenames -F _vestige vestige-explorer vestige-mini-sim vestige-replay
