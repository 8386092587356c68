# The ways that use this machine's own Python: as it is, or after apt has installed Debian's packages.
# shellcheck shell=bash

use_host() {
  local candidate said
  reason="there is none"
  for candidate in "$(type -P python3)" /usr/bin/python3; do
    [[ -x $candidate ]] || continue
    if said=$("$candidate" "$here/steps/dolfinx_version.py" 2>&1); then
      way=host
      python=$candidate
      say "using DOLFINx ${said##*$'\n'} of $python"
      return 0
    fi
    reason="$candidate: ${said##*$'\n'}"
  done
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
    if apt_install $(all_packages); then
      way=apt
      python=/usr/bin/python3
      return 0
    fi
    reason="apt-get failed (see above); is the network up?"
  fi
  return 1
}
