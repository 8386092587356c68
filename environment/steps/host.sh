# The ways that use this machine's own Python: as it is, or after apt has installed Debian's packages.
# shellcheck shell=bash

use_host() {
  local candidate version
  for candidate in "$(type -P python3)" /usr/bin/python3; do
    if [[ -x $candidate ]] && version=$("$candidate" "$here/steps/dolfinx_version.py" 2>/dev/null); then
      way=host
      python=$candidate
      say "using DOLFINx $version of $python"
      return 0
    fi
  done
  reason="no DOLFINx >= 0.9 with real PETSc, petsc4py, slepc4py and mpi4py in it"
  return 1
}

use_apt() {
  local id version
  read -r id version <<<"$(release)" || true
  version=${version:-99} # testing and sid have no number
  if [[ $id != debian ]] || ((${version%%.*} < 13)); then
    reason="this is ${id:-no Debian} $version; DOLFINx >= 0.9 is in Debian 13 and later"
  elif ! is_root; then
    reason="this is Debian $version, but installing its packages needs root"
  else
    say "installing Debian's DOLFINx and the rest of environment/packages*.txt (about 2 minutes, once)"
    # shellcheck disable=SC2046  # one word a package
    if install $(all_packages); then
      way=apt
      python=/usr/bin/python3
      return 0
    fi
    reason="apt-get failed (see above); is the network up?"
  fi
  return 1
}
