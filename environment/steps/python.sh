# The Python parts that the system lacks, in a venv that sees the system's packages.
# shellcheck shell=bash

# inside COMMAND...: run in the environment that is being set up.
inside() (
  enter "$way" "$root" "$venv" "$checkout" "$mpi"
  "${entered[@]}" "$@"
)

# Set `checkout`: the metadata of this checkout, and the lists of what it needs.
describe_checkout() {
  checkout=$cache/python/checkout-$({ project_table && printf '%s\n' "$project"; } | digest)
  inside "$python" "$here/steps/installed.py" "$project" "$checkout" ||
    fail "cannot read $project/pyproject.toml (see above)"
}

# Set `checkout`, `venv` (shared by all checkouts that need the same) and `mpi`.
add_python_parts() {
  local identity
  venv="" mpi=""
  describe_checkout
  mpi=$({ inside mpirun --version 2>/dev/null || true; } | sed -n 's/.*(Open MPI) \([0-9]*\).*/\1/p')
  identity=$(inside "$python" -c 'import sys; print(sys.version, sys.prefix)')
  venv=$cache/python/parts-$({ cat "$here"/requirements*.txt "$checkout/needs.txt" && printf '%s\n' "$identity" "$root"; } | digest)
  [[ -e $venv/complete ]] || make_venv
}

make_venv() {
  local site
  say "installing the Python parts that the system lacks (about 1 minute, once)"
  rm -rf "$venv"
  logged "$cache/venv.log" inside "$python" -m venv --system-site-packages "$venv" ||
    fail "cannot make a venv with $python (see above)"
  # a Python that is itself a venv (the DOLFINx containers): a venv of it would see only what lies below it
  site=$(inside "$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  inside "$python" -c 'import site, sys; sys.prefix == sys.base_prefix or print(*site.getsitepackages(), sep="\n")' \
    >"$site/parent.pth"
  # what is there already is good enough (conda); the pins are for what is missing
  local wanted=(-r "$here/requirements-development.txt" -r "$checkout/needs.txt")
  inside "$venv/bin/python" -m pip --isolated install --dry-run --no-index -r "$checkout/needs.txt" &>/dev/null ||
    wanted+=(-r "$here/requirements.txt")
  logged "$cache/pip.log" inside "$venv/bin/python" -m pip install --disable-pip-version-check "${wanted[@]}" ||
    fail "pip failed (see above); is the network up?"
  touch "$venv/complete"
  say "the environment is ready"
}
