# Bash completion of palpate: commands and flags as --help prints them, so that they are always
# those of the installed program.
_palpate() {
  local current=${COMP_WORDS[COMP_CWORD]} words
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    words=$(palpate --help 2>/dev/null |
      sed -n -e '1,/^Subcommands:/d' -e 's/^  \([a-z]*\) .*/\1/p')
    mapfile -t COMPREPLY < <(compgen -W "$words --help --version" -- "$current")
  elif [[ $current == -* ]]; then
    words=$(palpate "${COMP_WORDS[1]}" --help 2>/dev/null | grep -oE '^ +(-[a-z],)?--[a-z0-9-]+' |
      grep -oE -- '--[a-z0-9-]+')
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  else
    compopt -o default # files
  fi
}
complete -F _palpate palpate
