# Set the environment up: choose the way, then add the Python parts.
# shellcheck shell=bash

source "$here/steps/enter.sh"
source "$here/steps/packages.sh"
source "$here/steps/host.sh"
source "$here/steps/root.sh"
source "$here/steps/python.sh"
source "$here/steps/wheel.sh"

# setup STAMP: one at a time; a second call waits for the first and finds its work done.
setup() {
  mkdir -p "$cache/ready" 2>/dev/null ||
    fail "cannot write to $cache; set XDG_CACHE_HOME to a folder with 5 GB free"
  exec 8>"$cache/lock"
  if ! flock --nonblock 8; then
    say "another call is setting the environment up; waiting for it"
    flock 8
  fi
  if ! ready "$1"; then
    trap 'say "interrupted; the next call makes anew what is half made"; exit 130' INT
    choose_way
    if [[ $way != wheel ]]; then
      add_python_parts
      compile_ahead
    fi
    printf '%s\n' "$way" "$root" "$venv" "$checkout" "$mpi" >"$1.partial"
    mv "$1.partial" "$1"
    trap - INT
  fi
  exec 8>&-
}

# The machine code that first runs would wait for; without it they compile it themselves.
compile_ahead() {
  [[ $suite == trixie ]] || return 0
  say "compiling time loops (1 to 2 minutes, once)"
  logged "$cache/compile.log" inside "$here/bin/gapbeam" compile || say "first runs will compile what they need"
}

# Set `way`, `root` (empty: this machine's own) and `python`.
choose_way() {
  root=""
  case $wish in
    host) use_host || fail "GAPBEAM_ENVIRONMENT=host: $reason" ;;
    apt) use_apt || fail "GAPBEAM_ENVIRONMENT=apt: $reason" ;;
    root) use_root || fail "GAPBEAM_ENVIRONMENT=root: $reason" ;;
    wheel) use_wheel || fail "GAPBEAM_ENVIRONMENT=wheel: $reason" ;;
    auto | gapbeam)
      local reasons=()
      if [[ $suite == trixie ]]; then
        use_host && return
        reasons+=("its own Python: $reason")
        if [[ $wish == gapbeam ]]; then
          use_wheel && return
          reasons+=("PyPI: $reason")
        fi
        use_apt && return
        reasons+=("apt: $reason")
      fi
      use_root && return
      reasons+=("a Debian root file system: $reason")
      no_way "${reasons[@]}"
      ;;
  esac
}

no_way() {
  {
    printf 'gapbeam: error: no way to provide DOLFINx >= 0.9 on this machine\n'
    printf '  %s\n' "$@"
    cat <<'HELP'
Try one of these instead:
  docker or podman   docker build -t gapbeam . && docker run --rm gapbeam --help
  conda              conda env create -f environment/conda.yml && conda activate gapbeam, then the same command again
HELP
  } >&2
  exit 1
}
