#!/usr/bin/env bash
# forward.sh PROOT... -- COMMAND...: run COMMAND in proot, which ignores signals; they are passed on from here.
#
# Away from a terminal both get a session of their own, so that what is sent to a whole group comes once.
# On a terminal they stay, as shells need it, and Ctrl-C reaches the command without us.
set -uo pipefail

proot=()
while [[ $1 != -- ]]; do
  proot+=("$1")
  shift
done
shift

passed=(TERM USR1 USR2 HUP)
session=()
if [[ -t 0 ]]; then
  trap '' INT QUIT
else
  passed+=(INT QUIT)
  session=(setsid)
fi

command="" early=() heard=""
declare -A sent=()
# shellcheck disable=SC2329  # traps call it
# pass SIGNAL: twice within a second is once, sent to this process and to its group, as timeout does.
pass() {
  local now=${EPOCHREALTIME//[!0-9]/}
  heard=yes
  ((now - ${sent[$1]:-0} > 1000000)) || return 0
  sent[$1]=$now
  if [[ -n $command ]]; then
    kill -s "$1" "$command" 2>/dev/null
  else
    early+=("$1")
  fi
}
for name in "${passed[@]}"; do
  # shellcheck disable=SC2064  # the name as it is now
  trap "pass $name" "$name"
done

exec {output}>&1
# shellcheck disable=SC2016  # for the shell in there
exec {told}< <(exec "${session[@]}" "${proot[@]}" env --default-signal=INT,QUIT /usr/bin/bash -c \
  'echo "$$" && exec >&'"$output $output"'>&- && exec "$@"' bash "$@")
child=$!
read -r command <&"$told"
exec {told}<&- {output}>&-
for name in ${early[@]+"${early[@]}"}; do
  kill -s "$name" "$command" 2>/dev/null
done

status=127
while
  heard=""
  wait "$child"
  ended=$?
  ((ended == 127)) || status=$ended # 127: it had ended already
  [[ -n $heard ]]
do :; done
exit "$status"
