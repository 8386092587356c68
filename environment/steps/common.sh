# Where the environment is kept and whether it is ready. Sourced on every call: keep it quick.
# shellcheck shell=bash

cache=${XDG_CACHE_HOME:-${HOME:?is not set; set it, or XDG_CACHE_HOME}/.cache}/gapbeam
[[ $cache == /* ]] || cache=$PWD/$cache

say() { printf 'gapbeam: %s\n' "$*" >&2; }

fail() {
  printf 'gapbeam: error: %s\n' "$@" >&2
  exit 1
}

digest() {
  local sum
  sum=$(sha256sum)
  printf '%s' "${sum:0:16}"
}

# the part of pyproject.toml that an installation follows from; not the settings of ruff and the like
project_table() { awk '/^\[/ { keep = /^\[(build-system|project|tool\.setuptools)/ } keep' "$project/pyproject.toml"; }

# Everything that an environment follows from, in one word.
fingerprint() {
  {
    cat "$here"/{*.txt,dpkg.cfg,steps/*.sh,steps/*.py} /etc/os-release
    project_table
    printf '%s\n' "$project" "$wish" "$suite" "$MACHTYPE" "$(type -P python3)"
  } | digest
}

# ready STAMP: read what an earlier set-up left: the way, the root file system (or nothing), the venv, the checkout's
# metadata, the version of Open MPI (or nothing).
ready() {
  [[ -f $1 ]] && { read -r way && read -r root && read -r venv && read -r checkout && read -r mpi; } <"$1" || return 1
  [[ -e $venv/complete && -d $checkout && ( -z $root || -d $root ) ]]
}
