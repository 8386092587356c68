#!/usr/bin/env bash
# become.sh USER GROUP FRAME... -- COMMAND...: become COMMAND, in the mounts that `bwrap FRAME...` makes.
#
# bubblewrap waits for what it starts, passes no signal on to it, and dies of those that were meant for it. So it starts
# something else here, which holds the mounts until this process has stepped in. There is then nothing in front of the
# command: process number, signals, Ctrl-C, jobs and exit status are its own.
set -euo pipefail
user=$1 group=$2

# Without root bubblewrap would make a user namespace, which holds the mounts, and one in that: where the first cannot be
# stepped into any more. Made here, it is left again by the second below.
((EUID == 0)) || exec unshare --user --map-root-user -- "${BASH_SOURCE[0]}" "$@"
back=()
((user == 0)) || back=(unshare --user --map-user="$user" --map-group="$group" --)
shift 2

frame=()
while [[ $1 != -- ]]; do
  frame+=("$1")
  shift
done
shift

# The holder tells its number, then writes until the pipe is full, and waits. It goes when the pipe is closed: below, or
# with this process. It is nobody's child, so that the command has none that it does not know.
exec {told}< <(exec bwrap "${frame[@]}" -- sh -c 'echo "$$" && exec yes 2>/dev/null' &)
wait "$!" || true # bash may have forgotten how it ended; the line below says whether there is a holder
read -r holder <&"$told" || {
  printf 'gapbeam: error: bubblewrap could not make the mounts (see above)\n' >&2
  exit 1
}
# shellcheck disable=SC2016  # for the shell in there
exec nsenter --target "$holder" --mount -- /usr/bin/bash -c 'exec '"$told"'<&-
  cd -- "$1" 2>/dev/null || {
    echo "gapbeam: error: $1 is not seen in the root file system; start the command in another folder" >&2
    exit 1
  }
  shift
  exec "$@"' bash "$PWD" "${back[@]}" "$@"
