# The way of pip alone: DOLFINx and the rest from PyPI, in a venv of Python 3.12 or later, without root and compiler.
# shellcheck shell=bash

# Set `way`, `python`, `checkout`, `venv` and `mpi`.
use_wheel() {
  python=$(python_of_wheel) || {
    reason="there is no python3 >= 3.12 with venv and pip"
    # bare Debian has no Python, and nothing that draws
    [[ $(release) == "debian 13"* ]] && is_root && apt_install python3-venv libegl1 libgl1-mesa-dri || return 1
    python=/usr/bin/python3
  }
  way=wheel root="" venv="" mpi=""
  describe_checkout
  venv=$cache/python/wheel-$({ cat "$checkout"/needs-*.txt && "$python" -c 'import sys; print(sys.version, sys.prefix)'; } | digest)
  [[ -e $venv/complete ]] || make_wheel_venv
}

python_of_wheel() {
  local candidate
  for candidate in $(type -P python3 python3.14 python3.13 python3.12); do
    if "$candidate" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 12))' &>/dev/null; then
      printf '%s' "$candidate"
      return
    fi
  done
  return 1
}

# What is needed to compile the time loop comes first, so that the rest is fetched meanwhile. Bytecode is made when used.
make_wheel_venv() {
  local install=("$venv/bin/python" -m pip install --disable-pip-version-check --no-compile) compiler=""
  say "installing DOLFINx and the rest from PyPI with $python (about a minute, once)"
  rm -rf "$venv"
  reason="pip failed (see above)"
  logged "$cache/venv.log" "$python" -m venv "$venv" || return 1
  logged "$cache/pip.log" "${install[@]}" -r "$checkout/needs-base.txt" || return 1
  logged "$cache/compile.log" inside python3 -c \
    "from gapbeam.commands.compile_ahead import seconds_of; seconds_of(0)" &
  compiler=$!
  logged "$cache/pip.log" "${install[@]}" -r "$checkout/needs-wheel.txt" || { kill "$compiler"; return 1; }
  wait "$compiler" || say "first runs will compile what they need"
  touch "$venv/complete"
}
