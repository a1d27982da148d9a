# Completion of liquidblend's command line in bash: commands and flags, as --help of each lists them.
_liquidblend() {
  local current=${COMP_WORDS[COMP_CWORD]} help word
  local -a command=()
  help=$("${COMP_WORDS[0]}" --help 2>/dev/null) || return
  local commands
  commands=$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]\{1,\}\) .*/\1/p' <<<"$help")
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if grep -qxF -- "$word" <<<"$commands"; then
      command=("$word")
      help=$("${COMP_WORDS[0]}" "$word" --help 2>/dev/null) || return
      break
    fi
  done
  local words
  if [[ $current == -* ]]; then
    words=$(sed -n 's/^  \(-[^ ]*\).*/\1/p' <<<"$help" | tr , '\n')
  elif [[ ${#command[@]} -eq 0 ]]; then
    words=$commands
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _liquidblend liquidblend
