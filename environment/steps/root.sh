# The way of a Debian root file system in the cache: bootstrapped once by mmdebstrap, entered with bubblewrap, or with
# proot in a container that allows no namespaces.
# shellcheck shell=bash

# Counts up when the way a root file system is made changes, so that older ones are not taken for it.
recipe=1

use_root() {
  local name
  choose_tool || return 1
  name=$suite-$({ all_packages && cat "$here/dpkg.cfg" && printf '%s\n' "$recipe" "$MACHTYPE"; } | digest)
  root=$cache/roots/$name
  if [[ ! -d $root ]]; then
    bootstrap || return 1
  fi
  python=/usr/bin/python3
}

# Set `way`: root (bubblewrap) or proot.
choose_tool() {
  if ! type -P mmdebstrap bwrap >/dev/null; then
    if ! is_root || ! type -P apt-get >/dev/null; then
      reason="mmdebstrap and bubblewrap are not installed; as root: apt-get install mmdebstrap bubblewrap uidmap"
      return 1
    fi
    say "installing mmdebstrap and bubblewrap (about 20 seconds, once)"
    if ! apt_install mmdebstrap bubblewrap debian-archive-keyring ca-certificates; then
      reason="mmdebstrap and bubblewrap could not be installed (see above); is the network up?"
      return 1
    fi
  fi
  if reason=$("$here/steps/become.sh" "$EUID" "$(id -g)" --dev-bind / / -- true 2>&1); then
    way=root
    return
  fi
  reason="bubblewrap may not make namespaces here ($reason), and proot is not installed"
  type -P proot >/dev/null || { is_root && apt_install proot; } || return 1
  say "this container allows no namespaces: using proot, which is slower (docker run --privileged avoids that)"
  way=proot
}

# Bootstrap beside and rename, so that a root file system that is there is a complete one.
bootstrap() {
  local partial=$root.partial free
  mkdir -p "$cache/roots"
  free=$(df --output=avail --block-size=1G "$cache/roots" | tail -n 1)
  if ((free < 5)); then
    reason="$cache has ${free// /} GB free, 5 are needed; set XDG_CACHE_HOME to a folder with more"
    return 1
  fi
  remove "$partial"
  apt_access >"$cache/apt.conf"
  # files of this machine that enter.sh lays over those of the root file system
  local overlaid=(--customize-hook='cd "$1/etc" && rm -f localtime resolv.conf && touch hosts localtime pip.conf resolv.conf')
  say "making a Debian $suite root file system with DOLFINx in $cache (about 2 minutes and 2 GB, once)"
  # shellcheck disable=SC2046  # no word where the mirror is not known: mmdebstrap has its own
  if ! logged "$cache/bootstrap.log" mmdebstrap --variant=minbase --include="$(all_packages | paste -sd,)" \
    --aptopt="$cache/apt.conf" --dpkgopt="$here/dpkg.cfg" "${overlaid[@]}" "$suite" "$partial" $(mirror); then
    remove "$partial"
    reason="mmdebstrap failed (see above); is the network up?"
    return 1
  fi
  mv "$partial" "$root"
}

# A root file system made without being root belongs to other user numbers, and only mmdebstrap's helper may remove it.
remove() {
  [[ -e $1 ]] || return 0
  rm -rf --one-file-system "$1" 2>/dev/null || mmdebstrap --unshare-helper rm -rf "$1"
}
