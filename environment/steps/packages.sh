# Debian: the list of packages, apt, the mirror.
# shellcheck shell=bash

# packages FILE...: the names in lists of packages
packages() { sed -e 's/#.*//' -e '/^[[:space:]]*$/d' "$@"; }

all_packages() { packages "$here/packages.txt" "$here/packages-development.txt"; }

is_root() { [[ $EUID -eq 0 ]]; }

# release: "debian 12", "ubuntu 24.04", "debian" for testing and sid
release() { (. /etc/os-release 2>/dev/null && printf '%s' "${ID:-} ${VERSION_ID:-}"); }

# logged FILE COMMAND...: run quietly; the end of what it said only when it fails.
logged() {
  local log=$1
  shift
  if ! "$@" >"$log" 2>&1; then
    printf -- '---- the last lines of %s\n' "$log" >&2
    tail -n 15 "$log" | cut -c -160 >&2
    return 1
  fi
}

# apt_install PACKAGE...: with this machine's apt, as root.
apt_install() {
  export DEBIAN_FRONTEND=noninteractive
  logged "$cache/apt.log" apt-get update && logged "$cache/apt.log" apt-get install -y --no-install-recommends "$@"
}

# The mirror that this machine's apt takes Debian from; nothing where that is not known.
mirror() {
  local codename
  codename=$(. /etc/os-release && [[ $ID == debian ]] && printf '%s' "${VERSION_CODENAME:-sid}") || return 0
  apt-get indextargets --no-release-info --format '$(RELEASE) $(COMPONENT) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
    awk -v codename="$codename" '
      $2 == "main" && ($1 == codename || $1 ~ /^(stable|testing|unstable|sid)$/) && $3 !~ /security/ { print $3; exit }'
}

# How this machine's apt reaches its mirror: proxies, time-outs, checks.
apt_access() { apt-config dump | grep -E '^Acquire::(https?|Check|Retries|Force)' || true; }
